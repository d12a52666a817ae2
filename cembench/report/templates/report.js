(() => {
  "use strict";
  const root = document.documentElement;
  root.classList.add("js");

  const element = (tag, properties = {}, ...children) => {
    const made = Object.assign(document.createElement(tag), properties);
    made.append(...children);
    return made;
  };
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];

  // --- light and dark: the system's setting, until the reader chooses ----------------------------

  const THEME = "cembench-theme";
  const system = matchMedia("(prefers-color-scheme: dark)");
  const chosen = (() => { try { return localStorage.getItem(THEME); } catch { return null; } })();
  if (chosen === "light" || chosen === "dark") root.dataset.theme = chosen;
  const isDark = () => (root.dataset.theme ?? (system.matches ? "dark" : "light")) === "dark";

  function prepareTheme() {
    const button = document.querySelector(".theme");
    const label = () => { button.textContent = isDark() ? "Light mode" : "Dark mode"; };
    button.addEventListener("click", () => {
      root.dataset.theme = isDark() ? "light" : "dark";
      try { localStorage.setItem(THEME, root.dataset.theme); } catch { /* not remembered then */ }
      label();
      recolour();
    });
    system.addEventListener("change", () => { label(); recolour(); });
    label();
  }

  // --- pages and records, by the part of the address after # --------------------------------------

  let title = "";
  let before = "";      // the hash under an opened record
  let place = 0;        // how far the report was scrolled when a page was opened

  const named = (hash) => {
    try { return hash.length > 1 ? document.getElementById(decodeURIComponent(hash.slice(1))) : null; }
    catch { return null; }
  };

  function navigate(event) {
    const target = named(location.hash);
    const record = target?.closest(".record");
    const shown = document.getElementById("record-shown");
    if (record) { openRecord(record); return; }
    const returning = shown.open && event !== undefined;
    if (shown.open) shown.close();
    if (returning && location.hash === before) return;
    before = location.hash;
    const page = target?.closest(".page") ?? null;
    if (page && !root.classList.contains("paged")) place = scrollY;
    const turned = document.querySelector(".page.current") !== page;
    document.querySelector(".page.current")?.classList.remove("current");
    page?.classList.add("current");
    root.classList.toggle("paged", page !== null);
    document.title = page ? `${page.querySelector("h2").textContent} – ${title}` : title;
    if (page && target === page) {
      scrollTo(0, 0);
      if (event) page.querySelector("h2").focus({ preventScroll: true });
    } else if (target) {
      target.scrollIntoView();
    } else if (event && turned) {
      scrollTo(0, place);
    }
    markCurrent();
  }

  function openRecord(record) {
    const shown = document.getElementById("record-shown");
    const copy = record.cloneNode(true);
    copy.removeAttribute("id");
    shown.replaceChildren(closer(shown), copy);
    shown.setAttribute("aria-label", `Record: ${copy.querySelector("h3").textContent}`);
    if (!shown.open) shown.showModal();
    shown.scrollTop = 0;
  }

  const closer = (dialog) => {
    const button = element("button", { type: "button", className: "close", textContent: "Close" });
    button.addEventListener("click", () => dialog.close());
    return button;
  };

  function prepareRecords() {
    const shown = element("dialog", { id: "record-shown" });
    document.body.append(shown);
    shown.addEventListener("click", (event) => { if (event.target === shown) shown.close(); });
    shown.addEventListener("close", () => {
      if (named(location.hash)?.closest(".record")) {
        history.replaceState(null, "", before || "#");
      }
    });
  }

  function markCurrent() {
    const inView = all(".report > section, .report > section > section")
      .filter((section) => section.getBoundingClientRect().top < innerHeight * 0.3).pop();
    const page = document.querySelector(".page.current");
    const id = page?.id ?? inView?.id;
    for (const link of all("#toc a")) {
      if (link.getAttribute("href") === `#${id}`) link.setAttribute("aria-current", "true");
      else link.removeAttribute("aria-current");
    }
  }

  function prepareContents() {
    const contents = document.querySelector(".contents");
    const menu = contents.querySelector(".menu");
    const open = (yes) => {
      contents.classList.toggle("open", yes);
      menu.setAttribute("aria-expanded", String(yes));
    };
    menu.addEventListener("click", () => open(!contents.classList.contains("open")));
    contents.addEventListener("click", (event) => { if (event.target.closest("a")) open(false); });
    let waiting = false;
    addEventListener("scroll", () => {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => { waiting = false; markCurrent(); });
    }, { passive: true });
  }

  // --- tables: ascending, descending, and original order; gaps last, footers fixed -----------------

  function prepareTable(table) {
    const body = table.tBodies[0];
    const heads = [...table.tHead.rows[table.tHead.rows.length - 1].cells];
    const original = [...body.rows];
    const words = new Intl.Collator("en", { numeric: true });
    const isGap = (text) => text === "" || /^[-–—]$/.test(text);
    if (all("td.w", body).some((cell) => cell.textContent.length > 45)) table.classList.add("wordy");

    const sort = (place, direction) => {
      const numeric = original.some((row) => row.cells[place].dataset.n !== undefined);
      const key = (row) => {
        const cell = row.cells[place];
        if (numeric) return cell.dataset.n === undefined ? null : Number(cell.dataset.n);
        const text = cell.textContent.trim();
        return isGap(text) ? null : text;
      };
      const compare = numeric ? (a, b) => a - b : words.compare;
      const keyed = original.map((row, k) => [key(row), k, row]);
      if (direction) {
        keyed.sort(([a, i], [b, j]) => {
          if (a === null || b === null) return (a === null) - (b === null) || i - j;
          return direction * compare(a, b) || i - j;
        });
      }
      body.append(...keyed.map(([, , row]) => row));
    };

    heads.forEach((head, place) => {
      const label = head.querySelector(".title");
      const button = element("button", { type: "button", className: "sort" });
      label.replaceWith(button);
      button.append(label);
      head.setAttribute("aria-sort", "none");
      button.addEventListener("click", () => {
        const next = { none: "ascending", ascending: "descending", descending: "none" };
        const now = next[head.getAttribute("aria-sort")];
        heads.forEach((other) => other.setAttribute("aria-sort", "none"));
        head.setAttribute("aria-sort", now);
        sort(place, { ascending: 1, descending: -1, none: 0 }[now]);
      });
    });
  }

  // --- remarks on a figure, at the pointer, the focus or a touch -----------------------------------

  function prepareRemarks() {
    const tip = element("div", { id: "tip", hidden: true });
    tip.setAttribute("role", "tooltip");
    document.body.append(tip);
    let owner = null;
    const hide = () => { tip.hidden = true; owner = null; };
    const show = (mark) => {
      owner = mark;
      tip.textContent = mark.dataset.why;
      tip.hidden = false;
      const box = mark.getBoundingClientRect();
      const left = Math.min(box.left, root.clientWidth - tip.offsetWidth - 8);
      const above = box.top - tip.offsetHeight - 6;
      tip.style.left = `${Math.max(8, left) + scrollX}px`;
      tip.style.top = `${(above > 4 ? above : box.bottom + 6) + scrollY}px`;
    };
    const marks = (handler) => (event) => {
      const mark = event.target.closest?.(".why");
      if (mark) handler(mark, event);
    };
    document.addEventListener("pointerover", marks(show));
    document.addEventListener("focusin", marks(show));
    document.addEventListener("click", marks((mark, event) => { event.preventDefault(); show(mark); }));
    document.addEventListener("pointerout", (event) => {
      // When an element scrolls away under a resting pointer, the pointer leaves it: ignore that.
      const left = event.pointerType === "mouse" && (owner?.contains(event.target) || tip.contains(event.target));
      if (left && !tip.contains(event.relatedTarget)) hide();
    });
    document.addEventListener("focusout", hide);
    // The browser scrolls to the element with the keyboard focus; that must not hide its remark.
    const follow = () => { if (owner?.matches(":focus")) show(owner); else hide(); };
    document.addEventListener("scroll", follow, { passive: true, capture: true });
    document.addEventListener("keydown", (event) => { if (event.key === "Escape") hide(); });
  }

  // --- claims by verdict ---------------------------------------------------------------------------

  function prepareClaims(claims) {
    const badges = all(".tally .badge", claims);
    if (badges.length < 2) return;
    for (const badge of badges) {
      const button = element("button", { type: "button", className: "badge" });
      button.dataset.verdict = badge.dataset.verdict;
      button.setAttribute("aria-pressed", "false");
      button.append(...badge.childNodes);
      badge.replaceWith(button);
    }
    const buttons = all(".tally button", claims);
    claims.querySelector(".tally").addEventListener("click", (event) => {
      const button = event.target.closest("button");
      if (!button) return;
      const only = button.getAttribute("aria-pressed") === "false" ? button.dataset.verdict : null;
      buttons.forEach((b) => b.setAttribute("aria-pressed", String(b.dataset.verdict === only)));
      all(".claim", claims).forEach((claim) => {
        claim.classList.toggle("filtered", only !== null && claim.dataset.verdict !== only);
      });
    });
  }

  // --- plots: the picture is shown until Plotly, unpacked for the first one, has drawn -------------

  let library = null;

  function plotly() {
    library ??= (async () => {
      const packed = atob(document.getElementById("plotly").textContent);
      const bytes = Uint8Array.from(packed, (letter) => letter.charCodeAt(0));
      const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
      document.head.append(element("script", { textContent: await new Response(stream).text() }));
      return window.Plotly;
    })();
    return library;
  }

  const colour = (name) => {
    const probe = element("span");
    probe.style.color = `var(${name})`;
    document.body.append(probe);
    const found = getComputedStyle(probe).color;
    probe.remove();
    return found;
  };

  function appearance() {
    const axis = {
      gridcolor: colour("--rule"), linecolor: colour("--soft"), zerolinecolor: colour("--rule"),
      tickcolor: colour("--soft"), ticks: "outside", ticklen: 4, automargin: true,
      title: { font: { size: 13 }, standoff: 10 },
    };
    return {
      paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { family: getComputedStyle(root).getPropertyValue("--sans"), size: 12, color: colour("--ink") },
      xaxis: axis, yaxis: axis,
      margin: { l: 56, r: 12, t: 10, b: 48 },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("--soft"), activecolor: colour("--ink") },
      hoverlabel: { font: { family: getComputedStyle(root).getPropertyValue("--sans") } },
    };
  }

  // In a narrow window, panels are stacked instead of side by side.
  const BAR = 28;  // pixels of the buttons over a plot
  const isAxis = (name) => /^[xy]axis/.test(name);
  const typeset = (words) => words.replace(/\b([A-Za-z])_([A-Z]+)\b/g, "<i>$1</i><sub>$2</sub>");
  const isNarrow = () => innerWidth < 700;
  const rowsOf = ({ data, layout }) => isNarrow()
    ? new Set(data.map((trace) => trace.xaxis ?? "x")).size : layout.grid?.rows ?? 1;
  const heightOf = (drawing) =>
    BAR + (isNarrow() ? 350 * rowsOf(drawing) : drawing.layout.height ?? 460);

  function layoutOf(drawing) {
    const { width, height, title, ...layout } = drawing.layout;
    const decades = { dtick: 1, exponentformat: "power", tickfont: { size: 10 } };
    const axes = Object.entries(layout).filter(([name]) => isAxis(name)).map(([name, axis]) => [name, {
      ...(axis.type === "log" ? decades : {}), ...axis,
      title: { ...axis.title, text: typeset(axis.title?.text ?? "") },
    }]);
    const stacked = isNarrow() && layout.grid
      ? { grid: { ...layout.grid, rows: rowsOf(drawing), columns: 1, ygap: 0.45 } } : {};
    return {
      ...layout,
      ...Object.fromEntries(axes),
      ...stacked,
      template: { layout: appearance() },
      autosize: true,
      margin: { ...layout.margin, t: (layout.margin?.t ?? 10) + BAR },
      legend: { ...layout.legend, orientation: "h", x: 0, xanchor: "left", yanchor: "top" },
      // On touch screens, moving a finger over a plot scrolls the page; a button zooms.
      ...(matchMedia("(pointer: coarse)").matches ? { dragmode: false } : {}),
    };
  }

  // Only known once a plot is drawn: a logarithmic axis of less than a decade or two gets
  // marks within decades, and the legend goes below the lowest labels of the axes.
  async function settle(board) {
    await window.Plotly.relayout(board, Object.fromEntries(
      Object.entries(board._fullLayout)
        .filter(([name, axis]) => isAxis(name) && axis.type === "log")
        .filter(([, { range }]) => Math.abs(range[1] - range[0]) < 2.2)
        .map(([name]) => [`${name}.dtick`, "D2"])));
    const legend = board.querySelector(".legend");
    if (!legend) return;
    const { t, h } = board._fullLayout._size;
    const high = board.clientHeight - t - 60;
    const bottom = board.getBoundingClientRect().top + t + h;
    const words = all("[class^='x'][class$='tick'] text, g[class^='g-x']", board).map((e) => e.getBoundingClientRect());
    const under = Math.max(0, ...words.map((box) => box.bottom - bottom)) + 14;
    const below = under + legend.getBoundingClientRect().height + 6;
    board.style.height = `${t + high + below}px`;
    await window.Plotly.relayout(board, {
      height: t + high + below, "margin.b": below, "legend.y": -under / high,
    });
  }

  async function draw(figure) {
    const drawing = JSON.parse(figure.querySelector(".drawing").textContent);
    const board = element("div", { className: "drawn" });
    const image = figure.querySelector(".canvas > img");
    board.style.height = `${heightOf(drawing)}px`;
    board.setAttribute("role", "group");
    board.setAttribute("aria-label", image?.alt ?? figure.querySelector("figcaption b").textContent);
    try {
      const Plotly = await plotly();
      figure.querySelector(".canvas").append(board);
      figure.classList.add("live");
      await Plotly.newPlot(board, drawing.data, layoutOf(drawing), {
        responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"],
      });
      board.drawing = drawing;
      await settle(board);
      board.classList.add("settled");
    } catch (error) {
      board.remove();
      figure.classList.remove("live");
      console.warn("This plot stays a picture:", error);
    }
  }

  function recolour() {
    for (const board of all(".drawn")) {
      if (board.drawing) window.Plotly.relayout(board, { template: { layout: appearance() } });
    }
  }

  function preparePlots() {
    if (!document.getElementById("plotly") || !window.DecompressionStream) return;
    const watch = new IntersectionObserver((seen) => {
      for (const { isIntersecting, target } of seen) {
        if (isIntersecting) { watch.unobserve(target); draw(target); }
      }
    }, { rootMargin: "400px" });
    all("figure.plot").forEach((figure) => watch.observe(figure));
  }

  // --- enlarged pictures; the next one keeps the zoom and position --------------------------------

  function prepareViewer() {
    const pictures = all("figure.picture");
    if (!pictures.length) return;
    const image = element("img", { alt: "", draggable: false });
    const stage = element("div", { className: "stage" }, image);
    const caption = element("p");
    caption.setAttribute("aria-live", "polite");
    const tools = element("div", { className: "tools" }, caption);
    const viewer = element("dialog", { id: "viewer" }, stage, tools);
    viewer.setAttribute("aria-label", "Picture");
    document.body.append(viewer);
    let group = [];
    let at = 0;
    let view = { scale: 1, x: 0, y: 0 };

    const paint = () => {
      image.style.transform = `translate(${view.x}px, ${view.y}px) scale(${view.scale})`;
    };
    const fit = () => {
      const scale = Math.min(stage.clientWidth / image.width, stage.clientHeight / image.height);
      view = {
        scale,
        x: (stage.clientWidth - image.width * scale) / 2,
        y: (stage.clientHeight - image.height * scale) / 2,
      };
      paint();
    };
    const zoom = (factor, x = stage.clientWidth / 2, y = stage.clientHeight / 2) => {
      const scale = Math.min(40, Math.max(0.05, view.scale * factor));
      const ratio = scale / view.scale;
      view = { scale, x: x - (x - view.x) * ratio, y: y - (y - view.y) * ratio };
      paint();
    };
    const show = (next) => {
      const last = image.width / image.height;
      const shift = next !== at;
      at = (next + group.length) % group.length;
      const source = group[at].querySelector("img");
      image.src = source.src;
      image.alt = source.alt;
      image.width = source.getAttribute("width");
      image.height = source.getAttribute("height");
      const words = group[at].querySelector("figcaption").cloneNode(true);
      words.querySelector(".files")?.remove();
      caption.textContent = `${at + 1} of ${group.length}: ${words.textContent.trim()}`;
      if (!shift || Math.abs(image.width / image.height - last) > 0.01 * last) fit();
    };
    const open = (figure) => {
      group = all("figure.picture", figure.closest(".page, .report > section, .report"));
      at = group.indexOf(figure);
      viewer.showModal();
      show(at);
      fit();
    };

    const actions = [
      ["‹", "Previous picture", () => show(at - 1)], ["›", "Next picture", () => show(at + 1)],
      ["−", "Smaller", () => zoom(1 / 1.5)], ["+", "Larger", () => zoom(1.5)],
      ["Fit", "Fit to the window", fit], ["Close", "Close", () => viewer.close()],
    ];
    for (const [text, label, action] of actions) {
      const button = element("button", { type: "button", textContent: text });
      button.setAttribute("aria-label", label);
      button.addEventListener("click", action);
      tools.append(button);
    }
    const keys = {
      ArrowLeft: actions[0][2], ArrowRight: actions[1][2], "-": actions[2][2], "+": actions[3][2],
      "=": actions[3][2], 0: fit,
    };
    viewer.addEventListener("keydown", (event) => {
      if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
    });

    const fingers = new Map();
    const spread = () => {
      const [a, b] = [...fingers.values()];
      return Math.hypot(a.x - b.x, a.y - b.y);
    };
    const local = (event) => {
      const box = stage.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    stage.addEventListener("wheel", (event) => {
      event.preventDefault();
      const { x, y } = local(event);
      zoom(Math.exp(-event.deltaY * (event.ctrlKey ? 0.01 : 0.002)), x, y);
    }, { passive: false });
    stage.addEventListener("pointerdown", (event) => {
      stage.setPointerCapture(event.pointerId);
      fingers.set(event.pointerId, local(event));
    });
    stage.addEventListener("pointermove", (event) => {
      const was = fingers.get(event.pointerId);
      if (!was) return;
      const now = local(event);
      if (fingers.size === 1) {
        view = { ...view, x: view.x + now.x - was.x, y: view.y + now.y - was.y };
        fingers.set(event.pointerId, now);
        paint();
      } else {
        const wide = spread();
        fingers.set(event.pointerId, now);
        const [a, b] = [...fingers.values()];
        zoom(spread() / wide, (a.x + b.x) / 2, (a.y + b.y) / 2);
      }
    });
    for (const end of ["pointerup", "pointercancel"]) {
      stage.addEventListener(end, (event) => fingers.delete(event.pointerId));
    }
    stage.addEventListener("dblclick", (event) => {
      const { x, y } = local(event);
      zoom(2.5, x, y);
    });
    addEventListener("resize", () => { if (viewer.open) fit(); });

    for (const figure of pictures) {
      const picture = figure.querySelector(".canvas > img");
      if (!picture) continue;
      const button = element("button", { type: "button", className: "enlarge" });
      button.setAttribute("aria-label", `Enlarge: ${picture.alt}`);
      picture.replaceWith(button);
      button.append(picture);
      button.addEventListener("click", () => open(figure));
    }
  }

  document.addEventListener("DOMContentLoaded", () => {
    title = document.title;
    prepareTheme();
    prepareContents();
    prepareRecords();
    all("table.sortable").forEach(prepareTable);
    all(".claims").forEach(prepareClaims);
    prepareRemarks();
    prepareViewer();
    navigate();
    preparePlots();
    addEventListener("hashchange", navigate);
  });
})();
