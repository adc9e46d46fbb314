"use strict";
// Draws the envelope, the head and the strands; drag turns, the wheel moves closer, the slider cuts.
(function () {
  const root = document.getElementById("turntable");
  const canvas = root.querySelector("canvas");
  const gl = canvas.getContext("webgl", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) {
    root.classList.add("unavailable");
    return;
  }
  gl.getExtension("OES_element_index_uint");
  const data = JSON.parse(document.getElementById("turntable-data").textContent);

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const points = (text) => {
    const raw = new Int16Array(bytes(text).buffer);
    return Float32Array.from(raw, (v) => v * data.step);
  };

  function mesh(part) {
    const position = points(part.positions);
    const index = new Uint32Array(bytes(part.indices).buffer);
    const normal = new Float32Array(position.length);
    for (let t = 0; t < index.length; t += 3) {
      const [a, b, c] = [index[t] * 3, index[t + 1] * 3, index[t + 2] * 3];
      const u = [0, 1, 2].map((k) => position[b + k] - position[a + k]);
      const v = [0, 1, 2].map((k) => position[c + k] - position[a + k]);
      const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      for (const i of [a, b, c]) for (let k = 0; k < 3; k++) normal[i + k] += n[k];
    }
    const colour = part.colours ? bytes(part.colours) : null;
    return { position, normal, index, colour, kind: gl.TRIANGLES };
  }

  function lines(part) {
    const all = points(part.positions);
    const counts = bytes(part.counts);
    const position = [];
    const normal = [];
    let first = 0;
    for (const count of counts) {
      for (let k = 0; k + 1 < count; k++) {
        const a = (first + k) * 3;
        const tangent = [0, 1, 2].map((i) => all[a + 3 + i] - all[a + i]);
        for (const e of [a, a + 3]) {
          position.push(all[e], all[e + 1], all[e + 2]);
          normal.push(...tangent);
        }
      }
      first += count;
    }
    return { position: new Float32Array(position), normal: new Float32Array(normal), kind: gl.LINES };
  }

  const program = gl.createProgram();
  const shader = (kind, text) => {
    const s = gl.createShader(kind);
    gl.shaderSource(s, text);
    gl.compileShader(s);
    gl.attachShader(program, s);
  };
  shader(gl.VERTEX_SHADER, `
    attribute vec3 position, normal, colour;
    uniform mat4 clip_from_model;
    uniform mat3 view_from_model;
    varying vec3 n, c;
    varying float height;
    void main() {
      n = view_from_model * normal;
      c = colour;
      height = position.y;
      gl_Position = clip_from_model * vec4(position, 1.0);
    }`);
  shader(gl.FRAGMENT_SHADER, `
    precision mediump float;
    varying vec3 n, c;
    varying float height;
    uniform vec3 tint;
    uniform float cut, own_colour, is_line;
    void main() {
      if (height > cut) discard;
      vec3 unit = normalize(n);
      float facing = abs(unit.z);
      float light = is_line > 0.5 ? 0.35 + 0.65 * sqrt(1.0 - unit.y * unit.y * 0.6)
                                  : 0.35 + 0.65 * max(dot(unit, normalize(vec3(0.3, 0.5, 0.8))), 0.35 * facing);
      gl_FragColor = vec4(mix(tint, c, own_colour) * light, 1.0);
    }`);
  gl.linkProgram(program);
  gl.useProgram(program);
  const uniform = (name) => gl.getUniformLocation(program, name);
  const attribute = (name) => gl.getAttribLocation(program, name);

  const buffer = (kind, values) => {
    const b = gl.createBuffer();
    gl.bindBuffer(kind, b);
    gl.bufferData(kind, values, gl.STATIC_DRAW);
    return b;
  };
  function upload(shape, tint) {
    return {
      kind: shape.kind,
      count: shape.index ? shape.index.length : shape.position.length / 3,
      position: buffer(gl.ARRAY_BUFFER, shape.position),
      normal: buffer(gl.ARRAY_BUFFER, shape.normal),
      colour: shape.colour ? buffer(gl.ARRAY_BUFFER, shape.colour) : null,
      index: shape.index ? buffer(gl.ELEMENT_ARRAY_BUFFER, shape.index) : null,
      tint,
    };
  }
  const parts = {
    envelope: upload(mesh(data.envelope), [0.36, 0.6, 0.78]),
    head: upload(mesh(data.head), [0.86, 0.74, 0.66]),
    seen: upload(lines(data.seen), [0.8, 0.3, 0.12]),
    rest: upload(lines(data.rest), [0.62, 0.59, 0.55]),
  };
  let low = Infinity;
  let high = -Infinity;
  for (const part of [data.envelope, data.seen, data.rest]) {
    const p = points(part.positions);
    for (let i = 1; i < p.length; i += 3) {
      low = Math.min(low, p[i]);
      high = Math.max(high, p[i]);
    }
  }

  // From here the envelope fills five sixths of the height.
  const half = points(data.envelope.positions).reduce((m, v, i) => (i % 3 === 1 ? Math.max(m, Math.abs(v)) : m), 60);
  const eye = data.camera;
  const home = Math.atan2(eye[0], eye[2]);
  const state = { turn: home, tilt: 0.12, distance: Math.min(2500, 2.9 * half + 80), auto: true };
  const control = (name) => root.querySelector(`[name=${name}]`);

  function draw() {
    const ratio = window.devicePixelRatio || 1;
    const [w, h] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    gl.viewport(0, 0, w, h);
    gl.clearColor(0.965, 0.96, 0.945, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const [st, ct] = [Math.sin(state.turn), Math.cos(state.turn)];
    const [sp, cp] = [Math.sin(state.tilt), Math.cos(state.tilt)];
    const right = [ct, 0, -st];
    const up = [-sp * st, cp, -sp * ct];
    const back = [cp * st, sp, cp * ct];
    const f = 2.4;
    const [near, far] = [20, 4000];
    const [a, b] = [(far + near) / (near - far), (2 * far * near) / (near - far)];
    const rows = [right.map((v) => (v * f * h) / w), up.map((v) => v * f), back.map((v) => v * a), back.map((v) => -v)];
    const last = [0, 0, -state.distance * a + b, state.distance];
    const clip = [];
    for (let k = 0; k < 3; k++) for (const row of rows) clip.push(row[k]);
    clip.push(...last);
    gl.uniformMatrix4fv(uniform("clip_from_model"), false, clip);
    const view = [];
    for (let k = 0; k < 3; k++) view.push(right[k], up[k], back[k]);
    gl.uniformMatrix3fv(uniform("view_from_model"), false, view);
    gl.uniform1f(uniform("cut"), low + (high - low) * 1.001 * Number(control("cut").value) / 100 + 1e-3);
    for (const [name, part] of Object.entries(parts)) {
      if (!control(name).checked || part.count === 0) continue;
      const bind = (slot, values, size, type, normalised) => {
        if (slot < 0) return;
        if (!values) {
          gl.disableVertexAttribArray(slot);
          gl.vertexAttrib3f(slot, 1, 1, 1);
          return;
        }
        gl.bindBuffer(gl.ARRAY_BUFFER, values);
        gl.enableVertexAttribArray(slot);
        gl.vertexAttribPointer(slot, size, type, normalised, 0, 0);
      };
      bind(attribute("position"), part.position, 3, gl.FLOAT, false);
      bind(attribute("normal"), part.normal, 3, gl.FLOAT, false);
      bind(attribute("colour"), part.colour, 3, gl.UNSIGNED_BYTE, true);
      gl.uniform3fv(uniform("tint"), part.tint);
      gl.uniform1f(uniform("own_colour"), part.colour && control("errors").checked ? 1 : 0);
      gl.uniform1f(uniform("is_line"), part.kind === gl.LINES ? 1 : 0);
      if (part.index) {
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, part.index);
        gl.drawElements(part.kind, part.count, gl.UNSIGNED_INT, 0);
      } else {
        gl.drawArrays(part.kind, 0, part.count);
      }
    }
  }

  let before = null;
  function frame(now) {
    if (state.auto && before !== null) state.turn = home + 0.9 * Math.sin(((now - start) / 1000) * 0.5);
    before = now;
    draw();
    if (state.auto) requestAnimationFrame(frame);
  }
  const start = performance.now();
  const still = window.matchMedia && window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  state.auto = !still;
  draw();
  if (state.auto) requestAnimationFrame(frame);

  let grip = null;
  canvas.addEventListener("pointerdown", (e) => {
    state.auto = false;
    grip = [e.clientX, e.clientY];
    canvas.setPointerCapture(e.pointerId);
  });
  canvas.addEventListener("pointermove", (e) => {
    if (!grip) return;
    state.turn -= (e.clientX - grip[0]) * 0.008;
    state.tilt = Math.max(-1.5, Math.min(1.5, state.tilt + (e.clientY - grip[1]) * 0.008));
    grip = [e.clientX, e.clientY];
    draw();
  });
  canvas.addEventListener("pointerup", () => (grip = null));
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    state.distance = Math.max(120, Math.min(2500, state.distance * Math.exp(e.deltaY * 0.001)));
    draw();
  }, { passive: false });
  root.addEventListener("input", draw);
  window.addEventListener("resize", draw);
})();
