// Turns the surfaces of a result: WebGL 2, drawn only when something changes. A button with
// data-surfaces="FILE" loads that file, which calls `surfaces`, and takes the place of the picture.
(() => {
  const VERTEX = `#version 300 es
  in vec3 place, moved; in float value;
  uniform mat4 view; uniform vec3 shift; uniform vec3 nudge; uniform float factor;
  out vec3 at; out float level;
  void main() {
    at = place + factor * moved + shift; level = value;
    gl_Position = view * vec4(at, 1) + vec4(nudge, 0);
  }`;
  const FRAGMENT = `#version 300 es
  precision highp float;
  in vec3 at; in float level;
  uniform sampler2D colors; uniform vec4 color; uniform vec3 eye; uniform vec2 limits; uniform bool mapped, lit;
  out vec4 ink;
  void main() {
    float share = clamp((level - limits.x) / (limits.y - limits.x), 0., 1.);
    vec3 plain = mapped ? texture(colors, vec2(.002 + .996 * share, .5)).rgb : color.rgb;
    float light = lit ? .7 + .3 * abs(dot(normalize(cross(dFdx(at), dFdy(at))), eye)) : 1.;
    ink = vec4(plain * light, 1) * color.a;
  }`;
  const UNIFORMS = ["view", "shift", "nudge", "factor", "color", "eye", "limits", "mapped", "lit"];
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const floats = (text) => new Float32Array(bytes(text));
  const rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const element = (parent, tag, options = {}, words = "") => {
    const made = Object.assign(document.createElement(tag), options);
    made.append(words);
    parent.append(made);
    return made;
  };

  class Viewer {
    constructor(place, data) {
      this.data = data;
      for (const part of data.parts) {
        part.shown = true;
        if (part.points.buffer) continue;
        part.points = floats(part.points);
        part.displacement = floats(part.displacement);
        part.triangles = new Uint32Array(bytes(part.triangles));
        part.edges = new Uint32Array(bytes(part.edges));
        for (const title in part.fields) part.fields[title] = floats(part.fields[title]);
        // The positions of all steps; the last one has all fields.
        const pressure = Object.keys(part.fields)[0], { points, displacement, fields } = part;
        part.places = [...(part.earlier ?? []).map((one) => ({
          points: floats(one.points),
          displacement: floats(one.displacement),
          fields: one.pressure ? { [pressure]: floats(one.pressure) } : {},
        })), { points, displacement, fields }];
      }
      this.map = data.maps[0];
      this.factor = 0;
      this.apart = data.dim === 3 ? 0.3 : 0;
      this.controls(place);
      this.canvas = element(place, "canvas", { tabIndex: 0, ariaLabel: "result; arrow keys turn it, + and − zoom" });
      const below = element(place, "div", { className: "scale" });
      this.scale = { low: element(below, "span"), bar: element(below, "i"), high: element(below, "span") };
      this.caption = element(place, "output", {}, `Drag to ${data.dim === 3 ? "turn (with Shift: move)" : "move"}, zoom by wheel (after a click, or with Ctrl) or two fingers, point at a face for its value.`);
      this.gl = this.canvas.getContext("webgl2", { alpha: true, antialias: true, preserveDrawingBuffer: true });
      if (!this.gl) { this.caption.textContent = "This browser has no WebGL 2."; return; }
      this.prepare();
      this.listen();
      new ResizeObserver(() => this.see(this.box)).observe(this.canvas);
      this.see(data.whole);
      this.paint();
    }

    controls(place) {
      const { data } = this, row = element(place, "div", { className: "filters" });
      const choice = element(row, "select", { ariaLabel: "map" });
      data.maps.forEach((map, i) => element(choice, "option", { value: i }, map.title));
      choice.onchange = () => { this.map = data.maps[choice.value]; this.paint(); };
      const slider = (name, most, value, set) => {
        const label = element(row, "label", {}, `${name} `);
        const input = element(label, "input", { type: "range", min: 0, max: most, step: most / 100, value });
        const shown = element(label, "span", {}, name === "deformation" ? " × 0" : "");
        input.oninput = () => { set(+input.value, shown); this.draw(); };
      };
      slider("deformation", 10 * data.factor, 0, (value, shown) => {
        this.factor = value;
        shown.textContent = ` × ${+value.toPrecision(3)}`;
      });
      if (data.parts.some((part) => part.apart.some(Boolean))) slider("apart", 1, this.apart, (value) => { this.apart = value; });
      if (data.steps?.length) {
        const label = element(row, "label", {}, "step "), last = data.steps.length;
        const input = element(label, "input", { type: "range", min: 1, max: last, step: 1, value: last });
        const shown = element(label, "span", {}, ` ${data.steps[last - 1]}`);
        input.oninput = () => { shown.textContent = ` ${data.steps[input.value - 1]}`; this.go(input.value - 1); };
      }
      for (const part of data.parts) {
        const label = element(row, "label"), box = element(label, "input", { type: "checkbox", checked: true });
        element(label, "span", { className: part.role }, ` ${part.name}`);
        box.onchange = () => { part.shown = box.checked; this.draw(); };
      }
      for (const [name, box] of [["Whole", "whole"], ["Contact", "contact"]]) {
        if (data[box]) element(row, "button", { type: "button" }, name).onclick = () => this.see(data[box]);
      }
    }

    prepare() {
      const { gl } = this, program = gl.createProgram();
      for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, source);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
      }
      ["place", "moved", "value"].forEach((name, i) => gl.bindAttribLocation(program, i, name));
      gl.linkProgram(program);
      gl.useProgram(program);
      this.at = Object.fromEntries(UNIFORMS.map((name) => [name, gl.getUniformLocation(program, name)]));
      const put = (kind, values) => {
        const buffer = gl.createBuffer();
        gl.bindBuffer(kind, buffer);
        gl.bufferData(kind, values, gl.STATIC_DRAW);
        return buffer;
      };
      for (const part of this.data.parts) {
        part.buffers = [part.points, part.displacement].map((values) => put(gl.ARRAY_BUFFER, values));
        part.values = gl.createBuffer();
        part.faces = put(gl.ELEMENT_ARRAY_BUFFER, part.triangles);
        part.lines = put(gl.ELEMENT_ARRAY_BUFFER, part.edges);
      }
      gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
      for (const axis of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, axis, gl.CLAMP_TO_EDGE);
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(gl.LEQUAL);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    }

    // The bodies where a step has them; maps of the last step alone are empty at others.
    go(step) {
      const { gl } = this;
      for (const part of this.data.parts) {
        Object.assign(part, part.places[step]);
        [part.points, part.displacement].forEach((values, i) => {
          gl.bindBuffer(gl.ARRAY_BUFFER, part.buffers[i]);
          gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
        });
      }
      this.paint();
      this.draw();
    }

    // Colours and values of the map that is chosen.
    paint() {
      const { gl, map } = this, stops = map.colors, mark = (x) => String(+x.toPrecision(4));
      const brush = new OffscreenCanvas(256, 1).getContext("2d"), shades = brush.createLinearGradient(0, 0, 256, 0);
      stops.forEach((color, i) => shades.addColorStop(i / (stops.length - 1), color));
      brush.fillStyle = shades;
      brush.fillRect(0, 0, 256, 1);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, brush.getImageData(0, 0, 256, 1));
      for (const part of this.data.parts) {
        gl.bindBuffer(gl.ARRAY_BUFFER, part.values);
        gl.bufferData(gl.ARRAY_BUFFER, part.fields[map.title] ?? new Float32Array(part.points.length / 3), gl.STATIC_DRAW);
      }
      this.scale.bar.style.background = `linear-gradient(to right, ${stops})`;
      [this.scale.low.textContent, this.scale.high.textContent] = map.limits.map(mark);
      this.draw();
    }

    // The view that shows a box (its two corners) whole, from the side of the slave's surface.
    see(box) {
      const { width, height } = this.canvas.getBoundingClientRect();
      const shifts = box === this.data.whole ? this.data.parts.map((part) => this.shift(part)) : [[0, 0, 0]];
      const low = box[0].map((x, i) => x + Math.min(0, ...shifts.map((s) => s[i])));
      const high = box[1].map((x, i) => x + Math.max(0, ...shifts.map((s) => s[i])));
      if (box !== this.box || !this.turn) this.turn = this.data.dim === 3 ? [...this.data.eye] : [-Math.PI / 2, Math.PI / 2];
      this.box = box;
      this.middle = low.map((x, i) => (x + high[i]) / 2);
      this.radius = Math.hypot(...low.map((x, i) => high[i] - x)) / 2 || 1;
      const wide = this.data.dim === 3 ? 2 * this.radius : Math.max(high[0] - low[0], (high[1] - low[1]) * width / height);
      this.zoom = 0.92 * Math.min(width, this.data.dim === 3 ? height : width) / wide;
      this.moved = [0, 0];
      const ratio = devicePixelRatio || 1;
      [this.canvas.width, this.canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
      this.draw();
    }

    get axes() {
      const [a, e] = this.turn, c = Math.cos(e);
      const right = [-Math.sin(a), Math.cos(a), 0], eye = [c * Math.cos(a), c * Math.sin(a), Math.sin(e)];
      return [right, [eye[1] * right[2] - eye[2] * right[1], eye[2] * right[0] - eye[0] * right[2], eye[0] * right[1] - eye[1] * right[0]], eye];
    }

    shift(part) { return part.apart.map((x) => x * this.apart * this.data.length); }

    draw() {
      this.screen = null;
      this.waiting ||= requestAnimationFrame(() => { this.waiting = 0; this.render(); });
    }

    render() {
      const { gl, at, canvas, map, data } = this, axes = this.axes, ratio = devicePixelRatio || 1;
      const reach = 1 / (8 * Math.hypot(...data.whole[0].map((x, i) => data.whole[1][i] - x)) || 1);
      const size = [2 * this.zoom * ratio / canvas.width, 2 * this.zoom * ratio / canvas.height, -reach];
      const move = [2 * this.moved[0] * ratio / canvas.width, 2 * this.moved[1] * ratio / canvas.height, 0];
      const view = [0, 1, 2].flatMap((i) => [...size.map((s, k) => s * axes[k][i]), 0]);
      view.push(...size.map((s, k) => move[k] - s * dot(axes[k], this.middle)), 1);
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.uniformMatrix4fv(at.view, false, view);
      gl.uniform1f(at.factor, this.factor);
      gl.uniform3fv(at.eye, axes[2]);
      gl.uniform2fv(at.limits, map.limits);
      for (const part of data.parts.filter((p) => p.shown)) {
        const values = part.fields[map.title];
        gl.uniform3fv(at.shift, this.shift(part));
        [...part.buffers, part.values].forEach((buffer, i) => {
          gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
          gl.enableVertexAttribArray(i);
          gl.vertexAttribPointer(i, i < 2 ? 3 : 1, gl.FLOAT, false, 0, 0);
        });
        const ink = (color, opacity, mapped, lit) => {
          gl.uniform4f(at.color, ...rgb(color), opacity);
          gl.uniform1i(at.mapped, mapped);
          gl.uniform1i(at.lit, lit);
        };
        // Slave faces are a pixel before their body, edges two before their faces: none hides another.
        const before = (pixels) => -2 * pixels * reach / this.zoom;
        gl.uniform3f(at.nudge, 0, 0, before(part.body ? 0 : 1));
        if (part.triangles.length && (values || part.body)) {
          ink(part.fill, 1, !!values, data.dim === 3);
          gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, part.faces);
          gl.drawElements(gl.TRIANGLES, part.triangles.length, gl.UNSIGNED_INT, 0);
        }
        // Lines in the plane, of contact and rigid, are thick: drawn next to themselves.
        const line = !part.triangles.length, thick = line ? [-2, -1, 0, 1, 2] : [0];
        ink(!values ? part.color : part.body ? "#1f2933" : "#ffffff", line && (values || part.body) ? 1 : 0.45, line && !!values, false);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, part.lines);
        for (const x of thick) for (const y of thick) {
          gl.uniform3f(at.nudge, 2 * x / canvas.width, 2 * y / canvas.height, before(part.body ? 2 : 3));
          gl.drawElements(gl.LINES, part.edges.length, gl.UNSIGNED_INT, 0);
        }
      }
    }

    // What is under a place of the canvas in pixels: the part, the place in the mesh, the value.
    under(x, y) {
      const { width, height } = this.canvas.getBoundingClientRect(), axes = this.axes;
      this.screen ??= this.data.parts.map((part) => {
        const shift = this.shift(part), n = part.points.length, out = new Float32Array(n);
        for (let i = 0; i < n; i += 3) {
          const p = [0, 1, 2].map((k) => part.points[i + k] + this.factor * part.displacement[i + k] + shift[k] - this.middle[k]);
          out[i] = width / 2 + this.moved[0] + this.zoom * dot(p, axes[0]);
          out[i + 1] = height / 2 - this.moved[1] - this.zoom * dot(p, axes[1]);
          out[i + 2] = dot(p, axes[2]);
        }
        return out;
      });
      let best = null;
      this.data.parts.forEach((part, number) => {
        if (!part.shown || !(part.body || part.fields[this.map.title])) return;
        const s = this.screen[number], t = part.triangles;
        for (let i = 0; i < t.length; i += 3) {
          const [a, b, c] = [3 * t[i], 3 * t[i + 1], 3 * t[i + 2]];
          const twice = (s[b] - s[a]) * (s[c + 1] - s[a + 1]) - (s[c] - s[a]) * (s[b + 1] - s[a + 1]);
          const v = ((x - s[a]) * (s[c + 1] - s[a + 1]) - (s[c] - s[a]) * (y - s[a + 1])) / twice;
          const w = ((s[b] - s[a]) * (y - s[a + 1]) - (x - s[a]) * (s[b + 1] - s[a + 1])) / twice;
          if (!(v >= 0 && w >= 0 && v + w <= 1)) continue;
          const depth = (1 - v - w) * s[a + 2] + v * s[b + 2] + w * s[c + 2] + (part.body ? 0 : 1e-4 * this.radius);
          if (!best || depth > best.depth) best = { part, depth, nodes: [t[i], t[i + 1], t[i + 2]], shares: [1 - v - w, v, w] };
        }
      });
      return best;
    }

    say({ part, nodes, shares }) {
      const mean = (values, k, of) => shares.reduce((sum, share, i) => sum + share * values[of * nodes[i] + k], 0);
      const at = [...Array(this.data.dim).keys()].map((k) => +mean(part.points, k, 3).toPrecision(4)).join(", ");
      const values = part.fields[this.map.title];
      const value = values ? `${this.map.title} = ${+mean(values, 0, 1).toPrecision(5)}, ` : "";
      this.caption.textContent = `${part.name}: ${value}at (${at})`;
    }

    listen() {
      const { canvas } = this, fingers = new Map();
      const closer = (by) => { this.zoom *= by; this.moved = this.moved.map((m) => m * by); this.draw(); };
      const turn = (dx, dy) => {
        this.turn[0] -= dx / 150;
        this.turn[1] = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, this.turn[1] + dy / 150));
      };
      const slide = (dx, dy) => { this.moved = [this.moved[0] + dx, this.moved[1] - dy]; };
      canvas.oncontextmenu = (event) => event.preventDefault();
      canvas.onpointerdown = (event) => { canvas.setPointerCapture(event.pointerId); fingers.set(event.pointerId, event); };
      canvas.onpointerup = canvas.onpointercancel = (event) => fingers.delete(event.pointerId);
      canvas.onpointermove = (event) => {
        const before = fingers.get(event.pointerId);
        if (!before) {
          const found = this.under(event.offsetX, event.offsetY);
          if (found) this.say(found);
          return;
        }
        const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
        if (fingers.size > 1) {
          const other = [...fingers.values()].find((finger) => finger.pointerId !== event.pointerId);
          const away = (finger) => Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY);
          slide(dx / 2, dy / 2);
          closer(away(event) / Math.max(away(before), 1));
        } else if (this.data.dim === 2 || event.buttons !== 1 || event.shiftKey) slide(dx, dy);
        else turn(dx, dy);
        fingers.set(event.pointerId, event);
        this.draw();
      };
      canvas.addEventListener("wheel", (event) => {
        if (!event.ctrlKey && document.activeElement !== canvas) return; // the wheel scrolls the page
        event.preventDefault();
        closer(Math.exp(-event.deltaY / 500));
      }, { passive: false });
      canvas.onkeydown = (event) => {
        const step = { ArrowLeft: [-15, 0], ArrowRight: [15, 0], ArrowUp: [0, -15], ArrowDown: [0, 15] }[event.key];
        if (step) (this.data.dim === 2 ? slide : turn)(...step);
        else if ("+-".includes(event.key)) closer(event.key === "+" ? 1.2 : 1 / 1.2);
        else return;
        event.preventDefault();
        this.draw();
      };
    }
  }

  const loaded = new Map();
  window.surfaces = (name, data) => loaded.set(name, data);
  let current;
  const open = (button) => {
    const begin = () => {
      // A browser keeps few WebGL contexts: one viewer is open at a time.
      current?.place.replaceWith(current.button);
      current?.place.viewer.gl?.getExtension("WEBGL_lose_context")?.loseContext();
      const place = document.createElement("div");
      place.className = "turned";
      button.replaceWith(place);
      place.viewer = new Viewer(place, loaded.get(button.dataset.surfaces));
      current = { place, button };
    };
    if (loaded.has(button.dataset.surfaces)) { begin(); return; }
    const script = document.createElement("script");
    script.src = button.dataset.surfaces;
    script.onload = begin;
    script.onerror = () => button.replaceWith(`${button.dataset.surfaces} is missing.`);
    document.head.append(script);
  };
  addEventListener("DOMContentLoaded", () => {
    for (const button of document.querySelectorAll("[data-surfaces]")) {
      button.hidden = false;
      button.onclick = () => open(button);
      if (button.dataset.open !== undefined) open(button);
    }
  });
})();
