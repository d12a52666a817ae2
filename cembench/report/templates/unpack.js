/* Return what compressed text (gzip in base 85, as in RFC 1924) holds, as an ArrayBuffer. */
async function unpacked(text) {
  const DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz!#$%&()*+-;<=>?@^_`{|}~";
  const values = new Uint8Array(128);
  for (let k = 0; k < 85; k++) values[DIGITS.charCodeAt(k)] = k;
  const length = Math.floor(text.length * 4 / 5);
  const packed = new DataView(new ArrayBuffer(length + 4));
  for (let i = 0, place = 0; i < text.length; i += 5, place += 4) {
    let value = 0;
    for (let k = i; k < i + 5; k++) value = 85 * value + (k < text.length ? values[text.charCodeAt(k)] : 84);
    packed.setUint32(place, value);
  }
  const content = new Blob([new Uint8Array(packed.buffer, 0, length)]);
  return new Response(content.stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}
