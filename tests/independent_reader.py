"""A second, slow and obvious reader that only counts: what cembench's readers are held against."""

import re


def counts(path):
    """The numbers of vertices and of polygons that a file declares or lists (STL: no vertices)."""
    content = path.read_bytes()
    text = re.sub("\r\n?", "\n", content.decode("latin-1"))
    if path.suffix == ".obj":
        text = re.sub("(?m)#.*|^o .*", "", text.removeprefix("\xef\xbb\xbf"))
        words = [line.split()[:1] for line in text.replace("\\\n", " ").split("\n")]
        return words.count(["v"]), words.count(["f"]) + words.count(["fo"])
    if path.suffix == ".off":
        words = re.sub("#.*", "", text.removeprefix("\xef\xbb\xbf")).split()
        declared = words if words[0].isdigit() else words[1:]
        return int(declared[0]), int(declared[1])
    if path.suffix == ".ply":
        return tuple(
            int(re.search(rf"element\s+{name}\s+(\S+)", text)[1]) for name in ("vertex", "face")
        )
    if len(content) == 84 + 50 * int.from_bytes(content[80:84], "little"):
        return None, int.from_bytes(content[80:84], "little")
    return None, len(re.findall(r"endfacet", text.lower()))
