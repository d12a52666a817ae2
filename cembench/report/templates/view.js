/* An interactive view of a surface and its image under one checkerboard, in plain WebGL 2.
   Each <div class="view"> holds one block of cembench.drawing.view_scene as text (base64).
   Without WebGL the class "off" is set, and what stands beside the view remains. */
(() => {
  "use strict";
  document.documentElement.classList.add("js");
  const VERTEX = `#version 300 es
    in vec3 at; in vec3 normal; in vec2 image; in float value; in float folded;
    uniform mat3 turn; uniform vec2 zoom; uniform vec2 pan; uniform bool flat_;
    out vec2 board; out float shade; out float share; out float red;
    void main() {
      vec3 n = turn * normal, p = turn * at;
      if (flat_) p = vec3(2.0 * image - 1.0, folded);
      gl_Position = vec4(p.xy * zoom + pan, flat_ ? -0.5 * folded : -p.z * 0.4, 1.0);
      shade = pow(0.5 + 0.5 * dot(n, normalize(vec3(-0.3, 0.45, 0.85))), 0.9);
      board = image; share = value; red = folded;
    }`;
  const FRAGMENT = `#version 300 es
    precision highp float;
    in vec2 board; in float shade; in float share; in float red;
    uniform int mode; uniform float squares; uniform bool flat_;
    out vec4 colour;
    vec3 even(float t) { return mix(mix(vec3(.95, .95, .93), vec3(.93, .60, .25), min(2. * t, 1.)),
      vec3(.45, .08, .12), max(2. * t - 1., 0.)); }
    vec3 both(float t) { return t < .5 ? mix(vec3(.13, .33, .62), vec3(.95, .95, .93), 2. * t)
      : mix(vec3(.95, .95, .93), vec3(.80, .35, .05), 2. * t - 1.); }
    void main() {
      vec3 c;
      if (red > .5) c = vec3(.86, .11, .13);
      else if (mode == 0) {
        vec2 q = board * squares, wide = max(fwidth(q), vec2(1e-6));
        vec2 edge = clamp((.5 - abs(fract(q) - .5)) / wide, 0., .5) + .5;   /* soft edges */
        vec2 odd = mod(floor(q), 2.);
        vec2 s = (odd * 2. - 1.) * (edge * 2. - 1.);
        float sharp = 1. - smoothstep(.3, .9, max(wide.x, wide.y));
        c = mix(vec3(.95, .935, .90), vec3(.33, .52, .72), .5 - .5 * s.x * s.y * sharp);
      } else if (mode == 3) c = both(share);
      else c = even(share);
      float light = .32 + .68 * shade;
      if (flat_) light = 1. - .35 * (1. - light);
      else if (!gl_FrontFacing) light *= .62;
      colour = vec4(c * light, 1.);
    }`;
  const MODES = [
    ["checkerboard", null], ["angle error", "angle"], ["|\u03bc|", "mu"], ["texel density", "area"],
  ];
  const RAMPS = {
    even: "linear-gradient(90deg,#f2f2ed,#ed9940,#73141f)",
    both: "linear-gradient(90deg,#21549e,#f2f2ed,#cc590d)",
  };

  const make = (tag, properties = {}, ...children) => {
    const made = Object.assign(document.createElement(tag), properties);
    made.append(...children);
    return made;
  };

  /* Arrays are integers, byte by byte: the lowest bytes of all, then the next ones. Each is the
     difference from the same place of another array, or from the row before. */
  async function unpack(text) {
    const buffer = await unpacked(text);
    const length = new DataView(buffer).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    const arrays = {};
    let place = 4 + length;
    for (const [name, size, width, bytes, base] of head.arrays) {
      const packed = new Uint8Array(buffer, place, size * bytes);
      const values = arrays[name] = new Uint32Array(size);
      for (let i = 0; i < size; i++) {
        let value = base ? arrays[base][i] : i < width ? 0 : values[i - width];
        for (let k = 0; k < bytes; k++) value += packed[k * size + i] * 256 ** k;
        values[i] = value % 256 ** bytes;
      }
      place += size * bytes;
    }
    return { head, arrays };
  }

  function normals(V, F) {
    const N = new Float32Array(V.length);
    for (let t = 0; t < F.length; t += 3) {
      const [a, b, c] = [3 * F[t], 3 * F[t + 1], 3 * F[t + 2]];
      const u = [0, 1, 2].map((k) => V[b + k] - V[a + k]);
      const v = [0, 1, 2].map((k) => V[c + k] - V[a + k]);
      for (const corner of [a, b, c]) {
        N[corner] += u[1] * v[2] - u[2] * v[1];
        N[corner + 1] += u[2] * v[0] - u[0] * v[2];
        N[corner + 2] += u[0] * v[1] - u[1] * v[0];
      }
    }
    for (let i = 0; i < N.length; i += 3) {
      const l = Math.hypot(N[i], N[i + 1], N[i + 2]) || 1;
      N[i] /= l; N[i + 1] /= l; N[i + 2] /= l;
    }
    return N;
  }

  /* Return values at vertices, `width` each, for the triangles' corners in order. */
  function atCorners(values, F, width) {
    const found = new Float32Array(F.length * width);
    for (let i = 0; i < F.length; i++) {
      for (let k = 0; k < width; k++) found[i * width + k] = values[F[i] * width + k];
    }
    return found;
  }

  /* Return a matrix in column order from one in row order. */
  const columns = (m) => [m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]];
  const times = (a, b) => [0, 1, 2].flatMap((i) => [0, 1, 2].map((j) =>
    a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j]));
  const about = (axis, angle) => {
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    return axis === "y" ? [c, 0, s, 0, 1, 0, -s, 0, c] : [1, 0, 0, 0, c, -s, 0, s, c];
  };

  class View {
    constructor(box) {
      this.box = box;
      this.chosen = 0; this.mode = 0; this.squares = 24;
      this.pointers = new Map();
    }

    async start() {
      this.canvas = make("canvas", { tabIndex: 0 });
      const gl = this.gl = this.canvas.getContext("webgl2", { antialias: true, alpha: true });
      if (!gl || !window.DecompressionStream) { this.box.classList.add("off"); return; }
      const { head, arrays } = await unpack(this.box.querySelector("script").textContent);
      this.head = head; this.arrays = arrays;
      this.canvas.setAttribute("role", "img");
      this.canvas.setAttribute("aria-label",
        `${head.title} and its image, side by side. Arrow keys turn, plus and minus zoom, 0 resets.`);
      this.build();
      this.prepare();
      this.load();
      this.reset();
      new ResizeObserver(() => this.draw()).observe(this.canvas);
      this.box.classList.add("live");
    }

    build() {
      const choice = (words, options, chosen) => {
        const list = make("select", {}, ...options.map((text, k) => new Option(text, k)));
        list.addEventListener("change", () => chosen(Number(list.value)));
        return make("label", {}, words, list);
      };
      const button = (words, told, action) => {
        const made = make("button", { type: "button", textContent: words, title: told });
        made.setAttribute("aria-label", told);
        made.addEventListener("click", action);
        return made;
      };
      const maps = choice("Algorithm", this.head.maps.map((m) => m.label), (k) => {
        this.chosen = k; this.load(); this.draw();
      });
      maps.hidden = this.head.maps.length < 2;
      maps.className = "maps";
      const modes = choice("Colours", MODES.map((m) => m[0]), (k) => {
        this.mode = k; this.load(); this.draw();
      });
      modes.className = "modes";
      this.scale = make("span", { className: "scale", hidden: true });
      this.finer = [
        button("\u25a6", "Larger squares", () => this.divide(1 / 2)),
        button("\u25a9", "Smaller squares", () => this.divide(2)),
      ];
      const tools = [
        button("\u2212", "Zoom out", () => this.zoomBy(1 / 1.25)),
        button("+", "Zoom in", () => this.zoomBy(1.25)),
        button("\u21ba", "Reset the view", () => this.reset()),
      ];
      this.told = make("p", { className: "told" });
      this.box.append(
        make("div", { className: "controls" }, maps, modes, ...this.finer, ...tools, this.scale),
        make("div", { className: "stage" }, this.canvas), this.told);
      this.listen();
    }

    divide(factor) {
      this.squares = Math.min(Math.max(this.squares * factor, 6), 6144);
      this.draw();
    }

    zoomBy(factor) {
      this.zoom = Math.min(Math.max(this.zoom * factor, 0.5), 200);
      this.draw();
    }

    reset() {
      this.turn = this.head.view; this.zoom = 1; this.pan = [0, 0];
      this.draw();
    }

    rotate(right, down) {
      this.turn = times(about("x", down), times(about("y", right), this.turn));
      this.draw();
    }

    listen() {
      const { canvas, pointers } = this;
      const spread = () => {
        const [a, b] = [...pointers.values()];
        return Math.hypot(a.x - b.x, a.y - b.y);
      };
      canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
        const tall = canvas.clientHeight > canvas.clientWidth;
        this.onImage = tall ? event.offsetY > canvas.clientHeight / 2
          : event.offsetX > canvas.clientWidth / 2;
      });
      canvas.addEventListener("pointermove", (event) => {
        const from = pointers.get(event.pointerId);
        if (!from) return;
        const before = pointers.size === 2 ? spread() : 0;
        pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
        if (before) { this.zoomBy(spread() / before); return; }
        const side = Math.min(canvas.clientWidth, canvas.clientHeight);
        const [dx, dy] = [event.offsetX - from.x, event.offsetY - from.y];
        if (this.onImage && this.zoom > 1) {
          const most = this.zoom;
          this.pan = [this.pan[0] + 2 * dx / side, this.pan[1] - 2 * dy / side]
            .map((v) => Math.min(Math.max(v, -most), most));
          this.draw();
        } else this.rotate(3.5 * dx / side, 3.5 * dy / side);
      });
      for (const end of ["pointerup", "pointercancel"]) {
        canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
      }
      canvas.addEventListener("wheel", (event) => {
        if (document.activeElement !== canvas && !event.ctrlKey) return;   /* the page scrolls */
        event.preventDefault();
        this.zoomBy(Math.exp(-event.deltaY / 400));
      }, { passive: false });
      const keys = {
        ArrowLeft: () => this.rotate(-0.15, 0), ArrowRight: () => this.rotate(0.15, 0),
        ArrowUp: () => this.rotate(0, -0.15), ArrowDown: () => this.rotate(0, 0.15),
        "+": () => this.zoomBy(1.25), "=": () => this.zoomBy(1.25), "-": () => this.zoomBy(0.8),
        0: () => this.reset(),
      };
      canvas.addEventListener("keydown", (event) => {
        if (!keys[event.key] || event.ctrlKey || event.metaKey) return;
        event.preventDefault();
        keys[event.key]();
      });
      canvas.addEventListener("webglcontextlost", () => this.box.classList.add("off"));
    }

    prepare() {
      const { gl, head, arrays } = this;
      const program = this.program = gl.createProgram();
      for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, source);
        gl.compileShader(shader);
        if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
        gl.attachShader(program, shader);
      }
      gl.linkProgram(program);
      gl.useProgram(program);
      gl.enable(gl.DEPTH_TEST);
      const V = Float32Array.from(arrays.V, (v, i) => 2 * v / head.steps.V - head.box[i % 3]);
      let [reach, seen] = [0, 0];   /* of a ball about it, and across as it is seen at first */
      for (let i = 0; i < V.length; i += 3) {
        reach = Math.max(reach, Math.hypot(V[i], V[i + 1], V[i + 2]));
        for (const row of [0, 3]) {
          seen = Math.max(seen, Math.abs([0, 1, 2].reduce((s, k) => s + head.view[row + k] * V[i + k], 0)));
        }
      }
      for (let i = 0; i < V.length; i++) V[i] /= reach;
      this.fit = 0.94 * reach / seen;
      this.F = arrays.F;
      this.buffers = {};
      this.give("at", atCorners(V, this.F, 3), 3);
      this.give("normal", atCorners(normals(V, this.F), this.F, 3), 3);
    }

    give(name, values, width) {
      const { gl } = this;
      this.buffers[name] ??= gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      const where = gl.getAttribLocation(this.program, name);
      gl.enableVertexAttribArray(where);
      gl.vertexAttribPointer(where, width, gl.FLOAT, false, 0, 0);
    }

    /* Data that depends on the algorithm and on the colours. */
    load() {
      const { arrays, head, F, chosen } = this;
      const uv = arrays[`uv${chosen}`];
      this.give("image", atCorners(Float32Array.from(uv, (v) => v / head.steps.uv), F, 2), 2);
      const perTriangle = (value) => Float32Array.from({ length: F.length }, (_, i) => value(Math.floor(i / 3)));
      const name = MODES[this.mode][1];
      const shares = name && arrays[`${name}${chosen}`];
      this.give("value", perTriangle((t) => (shares ? shares[t] / head.steps.share : 0)), 1);
      const folds = new Set(arrays[`folded${chosen}`]);
      this.give("folded", perTriangle((t) => (folds.has(t) ? 1 : 0)), 1);
      const { degrees, mu, doublings } = head.scales;
      const ends = { angle: ["0\u00b0", `${degrees}\u00b0 and more`], mu: ["0", `${mu} and more`],
        area: [`1/${2 ** (doublings / 2)}`, `${2 ** (doublings / 2)} times the mean`] }[name];
      this.scale.hidden = !name;
      if (name) {
        const ramp = make("i");
        ramp.style.background = RAMPS[name === "area" ? "both" : "even"];
        this.scale.replaceChildren(ends[0], ramp, ends[1]);
      }
      this.finer.forEach((b) => { b.hidden = !!name; });
      const shown = F.length / 3;
      const simplified = shown < head.triangles
        ? ` Simplified for this view: ${shown.toLocaleString("en")} of ${head.triangles.toLocaleString("en")} triangles.` : "";
      const red = folds.size ? " Folded triangles are red." : "";
      this.told.textContent = `${head.maps[chosen].about}${red}${simplified}`;
    }

    draw() {
      if (this.drawing || !this.turn) return;
      this.drawing = requestAnimationFrame(() => { this.drawing = 0; this.paint(); });
    }

    paint() {
      const { gl, canvas, program } = this;
      const density = Math.min(devicePixelRatio || 1, 2);
      const [w, h] = [canvas.clientWidth, canvas.clientHeight].map((v) => Math.round(v * density));
      if (!w || !h) return;
      if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      const place = (name) => gl.getUniformLocation(program, name);
      const tall = h > w;
      const side = tall ? Math.min(w, h / 2) : Math.min(w / 2, h);
      gl.uniformMatrix3fv(place("turn"), false, columns(this.turn));
      gl.uniform1i(place("mode"), this.mode);
      gl.uniform1f(place("squares"), this.squares);
      for (const image of [false, true]) {
        const [x, y] = tall ? [(w - side) / 2, image ? h / 2 - side : h / 2]
          : [image ? w / 2 : w / 2 - side, (h - side) / 2];
        gl.viewport(x, y, side, side);
        gl.scissor(x, y, side, side);
        gl.enable(gl.SCISSOR_TEST);
        const fill = (image ? 0.94 : this.fit) * this.zoom;
        gl.uniform1i(place("flat_"), image ? 1 : 0);
        gl.uniform2f(place("zoom"), fill, fill);
        gl.uniform2f(place("pan"), ...(image ? this.pan : [0, 0]));
        gl.drawArrays(gl.TRIANGLES, 0, this.F.length);
        gl.disable(gl.SCISSOR_TEST);
      }
    }
  }

  /* A view is made when it becomes visible, because browsers keep few contexts. */
  function prepareViews() {
    const watch = new IntersectionObserver((seen) => {
      for (const { isIntersecting, target } of seen) {
        if (!isIntersecting) continue;
        watch.unobserve(target);
        new View(target).start().catch((error) => {
          target.classList.add("off");
          console.warn(`no view: ${error.message}`);
        });
      }
    }, { rootMargin: "200px" });
    document.querySelectorAll(".view").forEach((box) => watch.observe(box));
  }
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", prepareViews);
  else prepareViews();
})();
