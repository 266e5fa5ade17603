// The orbitable view: drag turns, wheel or pinch zooms, right button or shift moves, double click goes back.
// Reads the JSON beside its canvas (artifacts/orbit.py); without WebGL the pictures elsewhere must do.
for (const figure of document.querySelectorAll("figure.orbit")) orbit(figure);

function orbit(figure) {
  const scene = JSON.parse(figure.querySelector("script").textContent);
  const canvas = figure.querySelector("canvas"), overlay = figure.querySelector(".labels");
  const gl = canvas.getContext("webgl", { antialias: true });
  if (!gl) {
    figure.hidden = true;
    return;
  }
  gl.getExtension("OES_standard_derivatives");
  const flat = program(gl, `
    attribute vec3 at; attribute vec3 colour; uniform mat4 view; uniform float size;
    varying vec3 shade; varying vec3 place;
    void main() { gl_Position = view * vec4(at, 1.0); gl_PointSize = size; shade = colour; place = at; }`, `
    #extension GL_OES_standard_derivatives : enable
    precision highp float; varying vec3 shade; varying vec3 place; uniform vec3 light;
    void main() {
      float lit = 1.0;
      if (light != vec3(0.0)) {
        vec3 face = cross(dFdx(place), dFdy(place));
        lit = 0.68 + 0.32 * abs(dot(normalize(face), light));
      }
      gl_FragColor = vec4(shade * lit, 1.0);
    }`);
  const ribbon = program(gl, `
    attribute vec3 at; attribute vec3 other; attribute vec3 colour; attribute float side;
    uniform mat4 view; uniform vec2 px; varying vec3 shade;
    void main() {
      vec4 a = view * vec4(at, 1.0), b = view * vec4(other, 1.0);
      vec2 along = (b.xy / b.w - a.xy / a.w) / px;
      float len = max(length(along), 1e-6);
      vec2 across = vec2(-along.y, along.x) / len;
      a.xy += side * across * px * a.w;
      a.z -= 2e-4 * a.w;
      gl_Position = a; shade = colour;
    }`, `
    precision mediump float; varying vec3 shade;
    void main() { gl_FragColor = vec4(shade, 1.0); }`);

  const layers = scene.layers.map(layer => {
    const positions = new Float32Array(bytes(layer.positions).buffer), colours = bytes(layer.colours);
    const made = layer.kind === "lines" ? ribbons(gl, positions, colours) : {
      count: positions.length / 3, at: buffer(gl, positions), colour: buffer(gl, colours) };
    return { ...layer, ...made };
  });
  const switches = figure.querySelector(".switches");
  for (const layer of layers) {
    const label = document.createElement("label"), box = document.createElement("input");
    box.type = "checkbox";
    box.checked = layer.shown;
    box.addEventListener("change", () => { layer.shown = box.checked; draw(); });
    label.append(box, " " + layer.name);
    switches.append(label);
  }
  const labels = scene.labels.map(label => {
    const element = document.createElement("span");
    element.textContent = label.text;
    element.title = `${label.area_m2} m²`;
    overlay.append(element);
    return { ...label, element };
  }).sort((a, b) => b.area_m2 - a.area_m2);

  const home = { azimuth: Math.PI * (1 - scene.azimuth_deg / 180), elevation: 0.42, distance: 2 * scene.radius_m,
    target: [0, 0, 0] };
  let camera = { ...home };
  const FOCAL = 2.2;

  function frame() {
    const { azimuth: a, elevation: e } = camera;
    const back = [Math.sin(a) * Math.cos(e), -Math.cos(a) * Math.cos(e), Math.sin(e)];
    const right = [Math.cos(a), Math.sin(a), 0];
    const up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2],
      back[0] * right[1] - back[1] * right[0]];
    const eye = back.map((x, n) => camera.target[n] + camera.distance * x);
    return { back, right, up, eye };
  }

  function matrix({ back, right, up, eye }) {
    const dot = axis => -(axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2]);
    const fx = FOCAL * Math.min(1, canvas.height / canvas.width), fy = fx * canvas.width / canvas.height;
    const near = camera.distance / 200, far = camera.distance + 20 * scene.radius_m;
    const A = -(far + near) / (far - near), B = -2 * far * near / (far - near);
    const m = [];
    for (let n = 0; n < 3; n++) m.push(fx * right[n], fy * up[n], A * back[n], -back[n]);
    m.push(fx * dot(right), fy * dot(up), A * dot(back) + B, -dot(back));
    return m;
  }

  function draw() {
    const scale = window.devicePixelRatio || 1;
    canvas.width = Math.round(canvas.clientWidth * scale);
    canvas.height = Math.round(canvas.clientHeight * scale);
    const at = frame(), view = matrix(at);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    for (const layer of layers.filter(one => one.shown)) {
      const used = layer.kind === "lines" ? ribbon : flat;
      gl.useProgram(used.program);
      gl.uniformMatrix4fv(used.uniform("view"), false, view);
      attribute(used, "at", layer.at, 3, gl.FLOAT, false);
      attribute(used, "colour", layer.colour, 3, gl.UNSIGNED_BYTE, true);
      if (layer.kind === "lines") {
        attribute(used, "other", layer.other, 3, gl.FLOAT, false);
        attribute(used, "side", layer.side, 1, gl.FLOAT, false);
        const half = Math.max(layer.width * scale, 1.2);
        gl.uniform2f(used.uniform("px"), half / canvas.width, half / canvas.height);
        gl.drawArrays(gl.TRIANGLES, 0, layer.count);
      } else {
        const light = [0.3, 0.2, 0.6].map((x, n) => at.back[n] + x), size = Math.hypot(...light);
        gl.uniform3fv(used.uniform("light"), layer.kind === "points" ? [0, 0, 0] : light.map(x => x / size));
        gl.uniform1f(used.uniform("size"), layer.width * scale);
        gl.drawArrays(layer.kind === "points" ? gl.POINTS : gl.TRIANGLES, 0, layer.count);
      }
    }
    place(view, at);
    figure.dataset.drawn = layers.filter(one => one.shown).length;
  }

  // Names of the surfaces that face the viewer, the largest first, none over another.
  function place(view, at) {
    const taken = [];
    for (const { element, at: p, normal } of labels) {
      const c = [0, 1, 3].map(n => view[n] * p[0] + view[4 + n] * p[1] + view[8 + n] * p[2] + view[12 + n]);
      const x = (c[0] / c[2] + 1) / 2 * canvas.clientWidth, y = (1 - c[1] / c[2]) / 2 * canvas.clientHeight;
      const facing = normal.reduce((sum, n, i) => sum + n * (at.eye[i] - p[i]), 0) > 0;
      const w = 3.6 * element.textContent.length + 4;
      const free = !taken.some(([u, v, o]) => Math.abs(u - x) < w + o && Math.abs(v - y) < 15);
      const inside = x > 0 && y > 0 && x < canvas.clientWidth && y < canvas.clientHeight;
      element.hidden = !(c[2] > 0 && facing && free && inside && layers[0].shown);
      if (element.hidden) continue;
      taken.push([x, y, w]);
      element.style.transform = `translate(-50%, -50%) translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }

  function move(dx, dy) {
    const { right, up } = frame(), step = 2 * camera.distance / (FOCAL * canvas.clientHeight);
    camera.target = camera.target.map((x, n) => x - step * (dx * right[n] - dy * up[n]));
  }

  const fingers = new Map();
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", event => {
    const finger = fingers.get(event.pointerId);
    if (!finger) return;
    const dx = event.clientX - finger.x, dy = event.clientY - finger.y;
    const before = fingers.size === 2 ? spread() : 0;
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (fingers.size === 2) {
      camera.distance *= before / Math.max(spread(), 1);
      move(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons & 2) {
      move(dx, dy);
    } else {
      camera.azimuth -= dx / 160;
      camera.elevation = Math.min(1.55, Math.max(-1.55, camera.elevation + dy / 160));
    }
    requestAnimationFrame(draw);
  });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, event => fingers.delete(event.pointerId));
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    camera.distance = Math.min(20, Math.max(0.02, camera.distance / scene.radius_m * Math.exp(event.deltaY / 700)))
      * scene.radius_m;
    requestAnimationFrame(draw);
  }, { passive: false });
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("dblclick", () => { camera = { ...home }; draw(); });
  canvas.addEventListener("keydown", event => {
    const step = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (step) {
      event.preventDefault();
      camera.azimuth += step[0];
      camera.elevation = Math.min(1.55, Math.max(-1.55, camera.elevation + step[1]));
    } else if (event.key === "+" || event.key === "-") {
      camera.distance *= event.key === "+" ? 0.9 : 1.1;
    }
    draw();
  });
  new ResizeObserver(draw).observe(canvas);
  draw();

  function attribute(used, name, from, size, type, normalised) {
    const place = gl.getAttribLocation(used.program, name);
    if (place < 0) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, from);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, type, normalised, 0, 0);
  }
}

function bytes(text) {
  return Uint8Array.from(atob(text), character => character.charCodeAt(0));
}

function buffer(gl, values) {
  const made = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, made);
  gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
  return made;
}

// Each line as two triangles that the vertex shader spreads to its width: WebGL's own lines are 1 px.
function ribbons(gl, positions, colours) {
  const lines = positions.length / 6, count = 6 * lines;
  const at = new Float32Array(3 * count), other = new Float32Array(3 * count);
  const colour = new Uint8Array(3 * count), side = new Float32Array(count);
  const corners = [[0, 1], [0, -1], [1, 1], [1, 1], [0, -1], [1, -1]];
  for (let line = 0; line < lines; line++)
    corners.forEach(([end, which], corner) => {
      const to = 6 * line + corner;
      for (let n = 0; n < 3; n++) {
        at[3 * to + n] = positions[6 * line + 3 * end + n];
        other[3 * to + n] = positions[6 * line + 3 * (1 - end) + n];
        colour[3 * to + n] = colours[6 * line + 3 * end + n];
      }
      side[to] = end ? -which : which;
    });
  return { count, at: buffer(gl, at), other: buffer(gl, other), colour: buffer(gl, colour), side: buffer(gl, side) };
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text.trim());
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return { program: made, uniform: name => gl.getUniformLocation(made, name) };
}
