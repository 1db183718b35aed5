// The page of a scene: its camera, its clock and its controls.
for (const data of document.querySelectorAll("#scene")) {
  const scene = JSON.parse(data.textContent);
  const { scaled, sum, dot, cross, unit, clamp } = vectors;
  const find = (selector) => document.querySelector(selector);
  const [canvas, slider, play, camera, layout] =
    ["canvas", "#time", "#play", "#camera", "#layout"].map(find);
  const [begin, end] = scene.range_s;
  const { at, stateOf, frameOf } = makeStates(scene);
  const shown = new Set();
  let [now, playing, last] = [begin, false, 0];

  // Colours are those of the style sheet, by day and by night.
  const INKS = ["s0", "s1", "s2", "s3", "s4", "s5", "muted", "ink", "block", "hull", "frame"];
  let inks = {};
  const readInks = () => {
    const style = getComputedStyle(document.documentElement);
    const brush = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
    const ink = (name) => {
      brush.fillStyle = style.getPropertyValue("--" + name).trim() || "#888";
      brush.fillRect(0, 0, 1, 1);
      return [...brush.getImageData(0, 0, 1, 1).data].slice(0, 3).map((c) => c / 255);
    };
    inks = Object.fromEntries(INKS.map((name) => [name, ink(name)]));
  };

  const renderer = makeRenderer(canvas, scene.meshes);
  find("#no-gl").hidden = Boolean(renderer);
  canvas.hidden = !renderer;

  /** A path from its first known place on, for the renderer: seconds or metres along it. */
  const pathOf = (flight, name) => {
    const { values } = flight.tracks[name];
    const row = (k) => Array.from(values.subarray(3 * k, 3 * k + 3));
    const known = Array.from({ length: flight.clock.count }, (_, k) => row(k)).filter((p) => !p.some(Number.isNaN));
    const first = known[0] || [0, 0, 0];
    const points = new Float32Array(flight.clock.count * 4);
    let along = 0;
    for (let k = 0; k < flight.clock.count; k++) {
      const place = sum(row(k), first, -1);
      if (name === "reference" && k > 0) along += Math.hypot(...sum(row(k), row(k - 1), -1)) || 0;
      const s = name === "reference" ? along : k / flight.clock.rate_hz;
      points.set(place.some(Number.isNaN) ? [0, 0, 0, -1e9] : [...place, s], 4 * k);
    }
    return { name, first, line: renderer.line(points) };
  };
  for (const flight of renderer ? scene.flights : []) {
    flight.paths = ["reference", "position"].filter((name) => flight.tracks[name])
      .map((name) => pathOf(flight, name));
  }

  // The camera turns around a place; angles in radians, distance in m.
  const box = [0, 1, 2].map((k) => {
    let [lo, hi] = [Infinity, -Infinity];
    for (const { tracks } of scene.flights) {
      for (let i = k; tracks.position && i < tracks.position.values.length; i += 3) {
        const x = tracks.position.values[i];
        if (!Number.isNaN(x)) [lo, hi] = [Math.min(lo, x), Math.max(hi, x)];
      }
    }
    return lo <= hi ? [lo, hi] : [0, 0];
  });
  const eye = { azimuth: 0.7, elevation: 0.42, distance: 1 };
  const lookAlong = () => {
    const courses = scene.flights.map((flight) => at(flight, "velocity", begin + 0.3 * (end - begin)));
    const course = courses.find((v) => v && Math.hypot(v[0], v[1]) > 0.3);
    eye.azimuth = (course ? Math.atan2(course[1], course[0]) : 0) + 0.7;
  };
  const setCamera = (kind) => {
    const span = Math.max(Math.hypot(...box.map(([lo, hi]) => hi - lo)), 4 * scene.reach_m);
    eye.distance = kind === "follow" ? 6.5 * scene.reach_m : 1.15 * span;
    eye.elevation = { follow: 0.42, whole: 0.6, above: 1.5 }[kind];
  };
  /** Where the eye is from what it looks at, and the matrix of four columns that makes the picture. */
  const look = (aspect) => {
    const { azimuth, elevation, distance } = eye;
    const flat = -distance * Math.cos(elevation);
    const from = [flat * Math.cos(azimuth), flat * Math.sin(azimuth), -distance * Math.sin(elevation)];
    const forward = unit(scaled(from, -1));
    const right = unit(cross(forward, [0, 0, -1]));
    const up = cross(right, forward);
    const [near, far] = [0.05 * distance, 60 * distance + 300];
    // A narrow view sees as much across as a square one.
    const f = 2.6 * Math.min(1, aspect);
    const depth = [(far + near) / (near - far), (2 * far * near) / (near - far)];
    const column = (v, w) => {
      const away = dot(forward, v);
      return [(f / aspect) * dot(right, v), f * dot(up, v), -depth[0] * away + w * depth[1], away];
    };
    const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].flatMap((axis) => column(axis, 0));
    return { from, matrix: axes.concat(column(scaled(from, -1), 1)) };
  };

  /** Whether a trunk stands between the eye and a vehicle, or around one of them. */
  const hides = (m, from, to) => {
    const [dn, de] = [to[0] - from[0], to[1] - from[1]];
    const toTrunk = [m[3] - from[0], m[7] - from[1]];
    const share = clamp((toTrunk[0] * dn + toTrunk[1] * de) / (dn * dn + de * de || 1), 0, 1);
    const apart = Math.hypot(toTrunk[0] - share * dn, toTrunk[1] - share * de);
    return apart < 1.05 * Math.hypot(m[0], m[4]) + scene.reach_m;
  };
  const groundItem = (origin) => {
    const reach = 9 * eye.distance + 8 * scene.cell_m;
    const wide = 10 * scene.cell_m;
    const offset = [0, 1].map((k) => origin[k] - Math.floor(origin[k] / wide) * wide);
    const size = 2 * reach;
    const model = [size, 0, 0, 0, 0, size, 0, 0, 0, 0, 0, 0, 0, -reach, scene.ground_m - origin[2], 1];
    return { mesh: "sheet", model, ink: [...inks.ink, 0.55], ground: { offset, cell: scene.cell_m, reach } };
  };
  const pathItem = (flight, own, { name, first, line }, origin, ratio) => {
    const flown = name === "position";
    return {
      line, shift: sum(origin, first, -1), width: (flown ? 2.2 : 1.3) * ratio,
      dash: flown ? 0 : 2.5 * scene.reach_m, ink: flown ? [...own, 0.95] : [...inks.ink, 0.5],
      now: flown ? now + flight.shift_s - flight.clock.begin_s : 1e9,
    };
  };
  /** Draws some of the flights into a part of the canvas. */
  const show = (who, states, area, ratio) => {
    const follows = camera.value === "follow";
    const origin = follows ? states[who[0]].place : box.map(([lo, hi]) => (lo + hi) / 2);
    const { from, matrix } = look(area[2] / area[3]);
    // From far away a vehicle is a dot: there it is drawn larger, and the page says so.
    const larger = follows ? 1 : Math.max(1, (0.028 * eye.distance) / scene.reach_m);
    find("#larger").textContent = larger > 1 ? ` Vehicles are drawn ${larger.toFixed(0)} times as large.` : "";
    const items = [groundItem(origin)];
    for (const i of who) {
      const [flight, state, own] = [scene.flights[i], states[i], inks["s" + i]];
      for (const path of flight.paths) items.push(pathItem(flight, own, path, origin, ratio));
      const frames = {};
      for (const piece of flight.pieces) {
        const on = piece.on;
        if (!(on in frames)) frames[on] = frameOf(flight, state, on, { origin, larger, shown });
        if (!frames[on]) continue;
        const m = matrices.times(frames[on], piece.at);
        const model = [0, 1, 2, 3].flatMap((c) => [m[c], m[4 + c], m[8 + c], c === 3 ? 1 : 0]);
        const veils = on === "world" && hides(m, from, sum(state.place, origin, -1));
        const ink = piece.ink === "own" ? own : inks[piece.ink];
        const lit = on === "shadow" || on === "drop" ? 0 : 1;
        items.push({ mesh: piece.mesh, model, ink: [...ink, veils ? 0.14 : piece.alpha], lit });
      }
    }
    // What hides goes first; of the rest the ground, which is below.
    const order = (item) => (item.ground ? 1 : item.ink[3] === 1 ? 0 : 2);
    renderer.view(area, matrix, from, items.sort((p, q) => order(p) - order(q)));
  };

  const draw = () => {
    const states = scene.flights.map((flight) => stateOf(flight, now));
    tell(states);
    if (!renderer) return;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(1, Math.round(x * ratio)));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    renderer.clear();
    const all = scene.flights.map((_, i) => i);
    const views = all.length > 1 && layout.value === "beside" ? all.map((i) => [i]) : [all];
    const part = Math.floor(width / views.length);
    views.forEach((who, v) => show(who, states, [v * part, 0, part, height], ratio));
    const { triangles, calls } = renderer.counted;
    find("#count").textContent = `${triangles} triangles in ${calls} draw calls this frame; ` +
      `${scene.triangles} in ${scene.draw_calls} with everything shown`;
  };

  /** The numbers of the instant, as a table. */
  const tell = (states) => {
    const number = (x, digits) => (x === null || Number.isNaN(x) ? "\u2013" : x.toFixed(digits).replace(/^-(0\.?0*)$/, "$1"));
    const has = (i, name, x) => (scene.flights[i].tracks[name] ? x : null);
    const wing = (state, k) => (state.share && state.swung_deg
      ? `${number(100 * state.share[k], 0)} %, ${number(state.swung_deg[k], 0)}\u00b0` : "\u2013");
    const tilt = (state) => (Math.acos(clamp(state.axes[2][2], -1, 1)) * 180) / Math.PI;
    const rows = states.map((state, i) => [
      scene.flights[i].name, wing(state, 0), wing(state, 1),
      number(state.velocity && Math.hypot(...state.velocity), 2),
      number(has(i, "position", -state.place[2]), 2), number(has(i, "attitude", tilt(state)), 1),
      number(state.thrust, 2),
    ]);
    const line = (cells, tag) => {
      const row = document.createElement("tr");
      for (const text of cells) row.appendChild(document.createElement(tag)).textContent = text;
      return row;
    };
    const head = ["", "left wing", "right wing", "speed m/s", "height m", "tilt deg", "thrust N"];
    find("#readings").replaceChildren(line(head, "th"), ...rows.map((cells) => line(cells, "td")));
    find("#now").textContent = now.toFixed(2) + " s";
  };

  const setTime = (t) => {
    now = clamp(t, begin, end);
    slider.value = now;
    document.dispatchEvent(new CustomEvent("squirrel:time", { detail: now }));
    draw();
  };
  const tick = (stamp) => {
    if (!playing) return;
    const t = now + Math.max(0, stamp - last) * 1e-3 * Number(find("#pace").value);
    last = stamp;
    setTime(t);
    if (t >= end) setPlaying(false);
    else requestAnimationFrame(tick);
  };
  const setPlaying = (on) => {
    const begins = on && !playing;
    playing = on;
    play.textContent = on ? "\u23f8" : "\u25b6";
    play.setAttribute("aria-label", on ? "pause" : "play");
    last = performance.now();
    if (begins && now >= end) setTime(begin);
    if (begins) requestAnimationFrame(tick);
  };
  slider.addEventListener("input", () => setTime(+slider.value));
  slider.addEventListener("keydown", (event) => {
    const steps = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 };
    if (!(event.key in steps)) return;
    event.preventDefault();
    setTime(now + steps[event.key] / scene.flights[0].clock.rate_hz);
  });
  play.addEventListener("click", () => setPlaying(!playing));
  document.addEventListener("squirrel:pick", (event) => setTime(event.detail));
  camera.addEventListener("change", () => {
    setCamera(camera.value);
    draw();
  });
  if (layout) layout.addEventListener("change", draw);
  for (const input of document.querySelectorAll("input[name=arrow]")) {
    const set = () => (input.checked ? shown.add(input.value) : shown.delete(input.value));
    input.addEventListener("change", () => {
      set();
      draw();
    });
    set();
  }

  const [nearest, farthest] = [2 * scene.reach_m, 1e4 * scene.reach_m];
  const turn = (right, up) => {
    eye.azimuth -= right;
    eye.elevation = clamp(eye.elevation + up, -0.2, 1.55);
    draw();
  };
  const zoom = (factor) => {
    eye.distance = clamp(eye.distance * factor, nearest, farthest);
    draw();
  };
  const fingers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
  }
  canvas.addEventListener("pointermove", (event) => {
    const old = fingers.get(event.pointerId);
    if (!old) return;
    const here = [event.clientX, event.clientY];
    const other = [...fingers].find(([id]) => id !== event.pointerId);
    fingers.set(event.pointerId, here);
    const apart = (p) => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]) || 1;
    if (other) zoom(apart(old) / apart(here));
    else turn((here[0] - old[0]) * 0.008, (here[1] - old[1]) * 0.008);
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(event.deltaY * 0.001));
  }, { passive: false });
  const keys = {
    ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0),
    ArrowUp: () => turn(0, 0.08), ArrowDown: () => turn(0, -0.08),
    "+": () => zoom(0.85), "=": () => zoom(0.85), "-": () => zoom(1.18), " ": () => setPlaying(!playing),
  };
  canvas.addEventListener("keydown", (event) => {
    if (!(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  });

  // The address may say when and from where, as #t=2.5&camera=whole&azimuth=40&elevation=20&distance=3.
  const follow = () => {
    const asked = new URLSearchParams(location.hash.slice(1));
    const number = (name, use) => {
      const x = parseFloat(asked.get(name));
      if (Number.isFinite(x)) use(x);
    };
    for (const [list, name] of [[camera, "camera"], [layout, "layout"]]) {
      const known = list && [...list.options].some((option) => option.value === asked.get(name));
      if (known) list.value = asked.get(name);
    }
    if (asked.has("camera")) setCamera(camera.value);
    number("azimuth", (x) => (eye.azimuth = (x * Math.PI) / 180));
    number("elevation", (x) => (eye.elevation = clamp((x * Math.PI) / 180, -0.2, 1.55)));
    number("distance", (x) => (eye.distance = clamp(x, nearest, farthest)));
    number("t", (x) => (now = x));
    setPlaying(false);
    setTime(now);
  };
  readInks();
  lookAlong();
  setCamera("follow");
  // Unless the address says otherwise, it begins where wings are first open: there is something to see.
  const links = [...document.querySelectorAll(".moments a")];
  const open = links.find((link) => link.textContent.startsWith("open "));
  if (open) now = parseFloat(open.hash.slice(3));
  follow();
  addEventListener("hashchange", follow);
  addEventListener("resize", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    readInks();
    draw();
  });
}
