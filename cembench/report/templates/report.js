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

  // --- what the page holds compressed: records, plots, pictures of plots, data -------------------

  let store = { texts: {}, plots: {}, records: {}, choices: {}, names: {}, cells: {} };

  async function openStore() {
    try {
      const content = await unpacked(document.getElementById("store").textContent);
      store = JSON.parse(new TextDecoder().decode(content));
    } catch (error) {
      document.getElementById("told").append(element("p", {
        textContent: "This browser cannot unpack the records, plots and data of this page. Its text, "
          + "tables and other pictures are complete, and the files beside it hold the rest.",
      }));
      all("#filter, .choose").forEach((part) => part.remove());
      console.warn("nothing unpacked:", error);
    }
  }

  const file = (text, type) => URL.createObjectURL(new Blob([text], { type }));

  // A picture that is shown several times is embedded where it is shown first.
  function prepareFiles() {
    const sources = new Map();
    for (const image of all("img[data-picture][src]")) sources.set(image.dataset.picture, image.src);
    for (const image of all("img[data-picture]:not([src])")) {
      const name = image.dataset.picture;
      if (!sources.has(name) && store.texts[name]) sources.set(name, file(store.texts[name], "image/svg+xml"));
      if (sources.has(name)) image.src = sources.get(name);
    }
    for (const link of all("a.data")) {
      const text = store.texts[decodeURIComponent(link.getAttribute("href"))];
      if (text !== undefined) link.href = file(text, "text/csv;charset=utf-8");
    }
  }

  // --- pages, records and the view (filter and sort orders), by the address after # ----------------
  // #ANCHOR?surface=NAME&algorithm=NAME&status=NAME&sort=TABLE:COLUMN&at=ANCHOR under a record

  let title = "";
  let before = "";      // the anchor under an opened record
  let place = 0;        // how far the report was scrolled when a page was opened

  const decoded = (text) => { try { return decodeURIComponent(text); } catch { return text; } };

  function address() {
    const [anchor, view] = location.hash.slice(1).split("?");
    return { anchor: decoded(anchor), view: new URLSearchParams(view), whole: view !== undefined };
  }

  const recordOf = (anchor) => (anchor.startsWith("record-") ? anchor.slice(7) : null);

  function hashOf(anchor) {
    const view = new URLSearchParams();
    if (recordOf(anchor) && before) view.set("at", before);
    for (const box of checked()) view.append(box.name, box.value);
    const sorts = all("figure.table").map(sortOf).filter(Boolean);
    if (sorts.length) view.set("sort", sorts.join(","));
    const words = String(view).replaceAll("%3A", ":").replaceAll("%2C", ",");
    return `#${encodeURIComponent(anchor)}${words && `?${words}`}`;
  }

  // The view goes along with every step, so that going back restores it.
  function keepView(anchor = address().anchor) {
    const hash = hashOf(anchor);
    history.replaceState({ kept: true }, "", hash === "#" && !location.hash ? null : hash);
  }

  function restoreView(view) {
    for (const box of all("#filter input[type=checkbox]")) box.checked = view.getAll(box.name).includes(box.value);
    const sorts = new Map((view.get("sort") ?? "").split(",").map((words) => words.split(":")));
    for (const figure of all("figure.table")) {
      const column = Number(sorts.get(figure.id) ?? 0);
      if (column || sortOf(figure)) figure.sortBy(column);
    }
    applyFilter();
  }

  function navigate(event) {
    const { anchor, view, whole } = address();
    const shown = document.getElementById("record-shown");
    if (!event || whole || history.state?.kept) restoreView(view);
    const key = recordOf(anchor);
    if (Object.hasOwn(store.records, key)) {
      const under = view.get("at") ?? (event ? before : "");
      if (!event || under !== before) show(under, event);
      openRecord(key);
    } else {
      const returning = shown.open && event !== undefined && anchor === before;
      if (shown.open) shown.close();
      if (!returning) show(anchor, event);
    }
    keepView();
  }

  function show(anchor, event) {
    before = anchor;
    const target = anchor ? document.getElementById(anchor) : null;
    const page = target?.closest(".page") ?? null;
    if (page && !root.classList.contains("paged")) place = scrollY;
    const turned = document.querySelector(".page.current") !== page;
    document.querySelector(".page.current")?.classList.remove("current");
    page?.classList.add("current");
    if (page?.id === "records") listRecords();
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

  function recordArticle(key) {
    const { title: name, head, fields } = store.records[key];
    const entry = ([inner, words]) => (inner
      ? element("span", { className: "entry" }, element("i", { textContent: inner }), ` ${words}`) : words);
    const list = (pairs) => element("dl", {}, ...pairs.map(([field, ...words]) => element("div", {},
      element("dt", { textContent: field }), element("dd", {}, ...words))));
    return element("article", { className: "record" }, element("h3", { textContent: name }), list(head),
      element("details", {}, element("summary", { textContent: "All fields" }),
        list(fields.map(([field, entries]) => [field, ...entries.map(entry)]))));
  }

  function listRecords() {
    const list = document.getElementById("all-records");
    if (!list || list.children.length) return;
    list.append(...Object.keys(store.records).map((key) => {
      const article = recordArticle(key);
      article.dataset.record = key;
      return article;
    }));
    applyFilter();
  }

  function openRecord(key) {
    const shown = document.getElementById("record-shown");
    const article = recordArticle(key);
    const copy = element("button", { type: "button", className: "copy", textContent: "Copy link" });
    shown.replaceChildren(closer(shown), copies(copy), article);
    shown.setAttribute("aria-label", `Record: ${article.querySelector("h3").textContent}`);
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
    shown.addEventListener("close", () => { if (recordOf(address().anchor)) keepView(before); });
    addEventListener("beforeprint", listRecords);
  }

  /* Make a button copy the link to this view; where that is not allowed, show the link. */
  function copies(button) {
    const words = button.textContent;
    button.addEventListener("click", async () => {
      const { anchor } = address();
      const link = location.href.split("#")[0] + hashOf(recordOf(anchor) ? anchor : anchorInView());
      try {
        await navigator.clipboard.writeText(link);
        button.textContent = "Copied";
      } catch {
        prompt("The link to this view:", link);
      }
      setTimeout(() => { button.textContent = words; }, 2000);
    });
    return button;
  }

  /* Return the anchor of the table, plot or section at the upper end of the window. */
  function anchorInView() {
    if (scrollY < 60) return document.querySelector(".page.current")?.id ?? "";
    const within = document.querySelector(".page.current") ?? document.querySelector(".report");
    return all("section[id], figure[id], .gallery[id]", within)
      .filter((part) => part.checkVisibility() && part.getBoundingClientRect().top < innerHeight * 0.3)
      .pop()?.id ?? "";
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
      if (yes) openFilter(false);
    };
    menu.addEventListener("click", () => open(!contents.classList.contains("open")));
    contents.addEventListener("click", (event) => { if (event.target.closest("a, .choose")) open(false); });
    let waiting = false;
    addEventListener("scroll", () => {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => { waiting = false; markCurrent(); });
    }, { passive: true });
  }

  // --- tables: ascending, descending, and original order; gaps last, footers fixed -----------------

  function prepareTable(figure) {
    const table = figure.querySelector("table");
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

    const order = { ascending: 1, descending: -1, none: 0 };
    figure.sortBy = (column) => {
      heads.forEach((head, place) => {
        const signed = Math.abs(column) === place + 1 ? Math.sign(column) : 0;
        head.setAttribute("aria-sort", Object.keys(order).find((word) => order[word] === signed));
      });
      sort(heads[Math.abs(column) - 1] ? Math.abs(column) - 1 : 0, Math.sign(column));
    };

    heads.forEach((head, place) => {
      const label = head.querySelector(".title");
      const button = element("button", { type: "button", className: "sort" });
      label.replaceWith(button);
      button.append(label);
      head.setAttribute("aria-sort", "none");
      button.addEventListener("click", () => {
        const next = { none: 1, ascending: -1, descending: 0 };
        figure.sortBy(next[head.getAttribute("aria-sort")] * (place + 1));
        keepView();
      });
    });
  }

  /* Return a table's sort order for the address: TABLE:COLUMN, the column negative if descending. */
  function sortOf(figure) {
    const heads = all("thead tr:last-child > th", figure);
    const place = heads.findIndex((head) => ["ascending", "descending"].includes(head.getAttribute("aria-sort")));
    if (place < 0) return "";
    return `${figure.id}:${heads[place].getAttribute("aria-sort") === "descending" ? "-" : ""}${place + 1}`;
  }

  // --- the filter: rows, columns and pictures by surface, algorithm and status ----------------------

  const FACETS = ["surface", "algorithm", "status"];
  let wanted = FACETS.map(() => new Set());  // the chosen places of each facet; none means all
  let tables = null;
  let filtered = false;

  const checked = () => all("#filter input[type=checkbox]:checked");
  const passes = (of) => of.every((choice, k) => choice === undefined || !wanted[k].size || wanted[k].has(choice));
  const only = (facet, choice) => FACETS.map((_, k) => (k === facet ? choice : undefined));
  const same = (choices) => {
    const found = new Set(choices.filter((choice) => choice !== undefined));
    return found.size === 1 ? [...found][0] : undefined;
  };
  const common = (cells) => FACETS.map((_, k) => same(cells.map((cell) => cell.of[k])));
  const several = (number, word) => `${number} ${word}${number === 1 ? "" : "s"}`;

  /* Return the facet and choice that a name in a table or plot means. */
  function meaning(words = "") {
    const name = words.trim().replace(/ \*$/, "");
    return Object.hasOwn(store.names, name) ? store.names[name] : [];
  }

  /* Return what rows and columns of a table are about: by their records, otherwise by their names. */
  function describe(figure) {
    const titles = all("thead tr:last-child .title", figure)
      .map((label) => [...label.childNodes].filter((part) => !part.classList?.contains("mark"))
        .map((part) => part.textContent).join(""));
    const groups = all("thead .groups > *", figure).flatMap((group) => Array(group.colSpan).fill(group));
    const rows = all("tbody tr", figure).map((row) => {
      const cells = [...row.cells].flatMap((cell, column) => {
        const link = cell.querySelector(".figure-link");
        return link ? [{ cell, column, of: store.cells[recordOf(link.hash.slice(1))] }] : [];
      });
      const of = common(cells);
      [...row.cells].forEach((cell, column) => {
        if (column && !FACETS.includes(titles[column].toLowerCase())) return;
        const [facet, choice] = meaning(cell.firstChild?.textContent);
        if (facet !== undefined) of[facet] ??= choice;
      });
      return { row, of, cells };
    });
    const own = titles.map((name, column) => {
      const cells = rows.flatMap((row) => row.cells.filter((cell) => cell.column === column));
      const named = [name, groups[column]?.textContent].map(meaning).find(([facet]) => facet === 1);
      return cells.length ? common(cells)[1] : named?.[1];
    });
    const algorithms = own.map((choice, column) => (groups[column]?.matches("th")
      ? choice ?? same(own.filter((_, k) => groups[k] === groups[column])) : choice));
    return { figure, rows, groups, algorithms };
  }

  /* Hide what a table has of other choices; return the numbers of rows and columns hidden. */
  function filterTable({ figure, rows, groups, algorithms }) {
    for (const { row, of, cells } of rows) {
      row.hidden = !passes(of) || (cells.length > 0 && !cells.some((cell) => passes(cell.of)));
      for (const { cell, of: own } of cells) cell.classList.toggle("filtered", !passes(own));
    }
    const left = rows.filter(({ row }) => !row.hidden);
    const off = algorithms.map((choice, column) => column > 0 && left.length > 0 && !passes(only(1, choice)));
    for (const row of all("tr:not(.groups)", figure)) {
      [...row.cells].forEach((cell, column) => { cell.hidden = off[column]; });
    }
    for (const group of new Set(groups)) {
      const span = groups.filter((other, column) => other === group && !off[column]).length;
      group.hidden = !span;
      group.colSpan = span || 1;
    }
    const blank = left.flatMap((row) => row.cells).filter(({ cell }) => !cell.hidden && cell.matches(".filtered"));
    const hidden = [rows.length - left.length, off.filter(Boolean).length];
    noteHidden(figure, [[hidden[0], `of ${rows.length} row`], [hidden[1], "column"], [blank.length, "number"]]);
    return hidden;
  }

  /* Say below a caption how much the filter hides there. */
  function noteHidden(part, counts) {
    const words = counts.filter(([number]) => number)
      .map(([number, word]) => (word.startsWith("of ") ? `${number} ${word}s` : several(number, word)));
    let note = part.querySelector(":scope > .left-out");
    if (!note && words.length) {
      note = element("p", { className: "left-out" });
      part.querySelector("figcaption, .caption").after(note);
    }
    if (note) note.textContent = words.length ? `Hidden by the filter: ${words.join(", ")}.` : "";
  }

  function filterPictures() {
    const pictures = all("figure[data-record]");
    for (const picture of pictures) picture.hidden = !passes(store.cells[picture.dataset.record] ?? []);
    for (const gallery of all(".gallery")) {
      const own = pictures.filter((picture) => gallery.contains(picture));
      noteHidden(gallery, [[own.filter((picture) => picture.hidden).length, `of ${own.length} picture`]]);
    }
    for (const record of all("#all-records > .record")) record.hidden = !passes(store.cells[record.dataset.record]);
    return [pictures.filter((picture) => picture.hidden).length, pictures.length];
  }

  /* Leave out the links to pages of other surfaces. */
  function filterPages() {
    const pages = all(".page:not(#records)");
    const left = pages.map((page) => {
      const cells = [
        ...all(".figure-link", page).map((link) => recordOf(link.hash.slice(1))),
        ...all("figure[data-record]", page).map((picture) => picture.dataset.record),
      ];
      return passes(only(0, same(cells.map((key) => store.cells[key][0]))));
    });
    pages.forEach((page, k) => {
      for (const link of all(`.cards a[href="#${page.id}"], .of-pages a[href="#${page.id}"]`)) {
        link.closest("li").hidden = !left[k];
      }
      for (const [selector, step] of [[".before", -1], [".after", 1]]) {
        const link = page.querySelector(`.turn ${selector}`);
        let next = k + step;
        while (pages[next] && !left[next]) next += step;
        if (!link) continue;
        link.hidden = !pages[next];
        if (pages[next]) Object.assign(link, { hash: pages[next].id, textContent: pages[next].querySelector("h2").textContent });
      }
    });
  }

  async function filterPlot(board) {
    const visible = board.drawing.data.map((trace) => (passes(only(...meaning(trace.name))) ? true : "legendonly"));
    if (visible.some((shown, k) => shown !== (board.data[k].visible ?? true))) {
      await window.Plotly.restyle(board, { visible });
    }
  }

  function applyFilter() {
    const boxes = checked();
    if (!boxes.length && !filtered) return;
    filtered = boxes.length > 0;
    wanted = FACETS.map((facet) => new Set(boxes.filter((box) => box.name === facet)
      .map((box) => store.choices[facet].indexOf(box.value))));
    tables ??= all("figure.table").map(describe);
    const counts = tables.map(filterTable);
    const [rows, columns] = [0, 1].map((k) => counts.reduce((sum, hidden) => sum + hidden[k], 0));
    const [pictures, allPictures] = filterPictures();
    filterPages();
    all(".drawn").filter((board) => board.drawing).forEach(filterPlot);
    const total = tables.reduce((sum, table) => sum + table.rows.length, 0);
    const shown = FACETS.map((facet) => boxes.filter((box) => box.name === facet).map((box) => box.value))
      .filter((names) => names.length)
      .map((names) => (names.length > 6 ? `${names.slice(0, 5).join(", ")} and ${names.length - 5} more` : names.join(", ")));
    const hidden = [
      [rows, `${rows} of ${several(total, "row")}`], [columns, several(columns, "column")],
      [pictures, `${pictures} of ${several(allPictures, "picture")}`],
    ].filter(([number]) => number).map(([, words]) => words);
    document.querySelector(".choose").textContent = filtered ? `Filter (${boxes.length})` : "Filter";
    const told = document.getElementById("told");
    told.replaceChildren();
    if (!filtered) return;
    const reset = element("button", { type: "button", textContent: "Show all" });
    reset.addEventListener("click", () => { document.getElementById("filter").reset(); });
    told.append(element("p", {}, element("b", { textContent: `Filter: ${shown.join(" · ")}.` }),
      ` Hidden on all pages: ${hidden.join(", ") || "nothing"}. `
      + "Means, counts, claims and findings still cover the whole run. ", reset));
  }

  function openFilter(yes) {
    const panel = document.getElementById("filter");
    if (!panel) return;
    panel.hidden = !yes;
    document.querySelector(".choose").setAttribute("aria-expanded", String(yes));
  }

  function prepareFilter() {
    const panel = document.getElementById("filter");
    if (!panel) return;
    const button = document.querySelector(".choose");
    button.addEventListener("click", () => openFilter(panel.hidden));
    const change = () => { applyFilter(); keepView(); };
    panel.addEventListener("change", change);
    panel.addEventListener("submit", (event) => event.preventDefault());
    panel.addEventListener("reset", () => setTimeout(() => { panel.dispatchEvent(new Event("input")); change(); }));
    panel.addEventListener("input", () => {
      for (const group of all("fieldset", panel)) {
        const part = group.querySelector("[type=search]")?.value.toLowerCase() ?? "";
        for (const label of all("label", group)) label.hidden = !label.textContent.toLowerCase().includes(part);
      }
    });
    panel.addEventListener("keydown", (event) => {
      if (event.key === "Escape") { openFilter(false); button.focus(); }
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
      const source = await unpacked(document.getElementById("plotly").textContent);
      document.head.append(element("script", { textContent: new TextDecoder().decode(source) }));
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
    const drawing = store.plots[figure.id];
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
      await filterPlot(board);
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
    const watch = new IntersectionObserver((seen) => {
      for (const { isIntersecting, target } of seen) {
        if (isIntersecting) { watch.unobserve(target); draw(target); }
      }
    }, { rootMargin: "400px" });
    all("figure.plot").filter((figure) => figure.id in store.plots).forEach((figure) => watch.observe(figure));
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

  document.addEventListener("DOMContentLoaded", async () => {
    title = document.title;
    prepareTheme();
    prepareContents();
    prepareRecords();
    copies(document.querySelector(".copy"));
    all("figure.table").forEach(prepareTable);
    all(".claims").forEach(prepareClaims);
    prepareRemarks();
    prepareViewer();
    show(address().view.get("at") ?? address().anchor);
    await openStore();
    prepareFiles();
    prepareFilter();
    navigate();
    preparePlots();
    addEventListener("hashchange", navigate);
  });
})();
