// The scene of flights: where each piece is at an instant, and who looks at it from where. Places are north, east, down.
for (const data of document.querySelectorAll("#scene")) {
  const scene = JSON.parse(data.textContent);
  const find = (selector) => document.querySelector(selector);
  const [canvas, slider, play, camera, layout] = ["canvas", "#time", "#play", "#camera", "#layout"].map(find);
  const [begin, end] = scene.range_s;
  const clamp = (x, lo, hi) => Math.min(Math.max(x, lo), hi);

  // Tracks: counts again from their differences, then numbers; NaN where the log says nothing.
  for (const flight of scene.flights) {
    for (const track of Object.values(flight.tracks)) {
      const sums = new Array(track.width).fill(0);
      track.values = Float64Array.from(track.deltas, (delta, k) =>
        delta === null ? NaN : (sums[k % track.width] += delta) * track.step);
    }
    const speeds = flight.tracks.rotor_speed;
    flight.turns = speeds && Float64Array.from(speeds.values);
    for (let k = 0; speeds && k < speeds.values.length; k++) {
      const before = k < speeds.width ? 0 : flight.turns[k - speeds.width];
      flight.turns[k] = before + (speeds.values[k] || 0) / 50 / flight.clock.rate_hz;
    }
  }
  /** The numbers of a track at a time of the page, or null. */
  const at = (flight, name, t) => {
    const track = flight.tracks[name];
    if (!track) return null;
    const place = clamp((t + flight.shift_s - flight.clock.begin_s) * flight.clock.rate_hz, 0, flight.clock.count - 1);
    const [i, w] = [Math.min(Math.floor(place + 1e-6), flight.clock.count - 1), track.width];
    const share = clamp(place - i, 0, 1);
    const a = Array.from(track.values.subarray(i * w, i * w + w));
    const b = share > 0 && i + 1 < flight.clock.count ? Array.from(track.values.subarray(i * w + w, i * w + 2 * w)) : a;
    const sign = name === "attitude" && a.reduce((sum, x, k) => sum + x * b[k], 0) < 0 ? -1 : 1;
    const values = a.map((x, k) => (share > 0 ? x + share * (sign * b[k] - x) : x));
    return values.some(Number.isNaN) ? null : values;
  };

  // Matrices: rows of three by four, the last column is a place.
  const times = (m, n) => {
    const out = [];
    for (let r = 0; r < 3; r++) {
      for (let c = 0; c < 4; c++) {
        out.push(m[4 * r] * n[c] + m[4 * r + 1] * n[4 + c] + m[4 * r + 2] * n[8 + c] + (c === 3 ? m[4 * r + 3] : 0));
      }
    }
    return out;
  };
  const columns = (x, y, z, p) => [0, 1, 2].flatMap((r) => [x[r], y[r], z[r], p[r]]);
  const moved = (p) => columns([1, 0, 0], [0, 1, 0], [0, 0, 1], p);
  const turned = (angle, p) => {
    const [s, c] = [Math.sin(angle), Math.cos(angle)];
    return columns([c, s, 0], [-s, c, 0], [0, 0, 1], p);
  };
  const rotation = (q) => {
    const size = Math.hypot(...q) || 1;
    const [w, x, y, z] = q.map((c) => c / size);
    return [
      [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
      [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
      [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ];
  };
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const scaled = (a, s) => a.map((x) => x * s);
  const unit = (a) => scaled(a, 1 / (Math.hypot(...a) || 1));

  /** What a flight is at a time: vectors in the world, angles of the wings, and frames on demand. */
  const stateOf = (flight, t) => {
    const place = at(flight, "position", t) || [0, 0, 0];
    const axes = rotation(at(flight, "attitude", t) || [1, 0, 0, 0]);
    const inWorld = (v) => [0, 1, 2].map((r) => axes[0][r] * v[0] + axes[1][r] * v[1] + axes[2][r] * v[2]);
    const thrust = at(flight, "thrust", t);
    const force = at(flight, "wing_force", t);
    const [share, wind, velocity] = ["deployment", "wind", "velocity"].map((name) => at(flight, name, t));
    const wing = flight.body.wing;
    return {
      place,
      axes,
      share,
      thrust: thrust && thrust.reduce((sum, x) => sum + x, 0),
      cranks: wing && (share || [0, 0]).map((d) => wing.stroke_deg * d),
      turns: flight.turns && flight.body.rotors.map((_, k) => {
        const w = flight.body.rotors.length;
        const last = clamp((t + flight.shift_s - flight.clock.begin_s) * flight.clock.rate_hz, 0, flight.clock.count - 1);
        const [i, j] = [Math.floor(last), Math.min(Math.floor(last) + 1, flight.clock.count - 1)];
        return flight.turns[i * w + k] + (last - i) * (flight.turns[j * w + k] - flight.turns[i * w + k]);
      }),
      velocity,
      reference: at(flight, "reference", t),
      arrows: {
        thrust: thrust && thrust.map((x, k) => [scaled(axes[2], -x * scene.arrow_m_per_n),
          inWorld(thrust.length > 1 ? flight.body.rotors[k].hub_body_m : [0, 0, 0])]),
        // The log has one force of both wings: half of it on each.
        wing_force: force && wing && [-1, 1].map((side, k) => {
          const out = 0.5 * wing.span_m * Math.sin(((wing.folded_deg + wing.stroke_deg * (share ? share[k] : 0)) * Math.PI) / 180);
          const [x, y, z] = wing.root_body_m;
          return [scaled(inWorld(force), 0.5 * scene.arrow_m_per_n), inWorld([x, side * (y + out), z])];
        }),
        weight: flight.body.weight_n && [[[0, 0, flight.body.weight_n * scene.arrow_m_per_n], [0, 0, 0]]],
        // Air flows past above the vehicle.
        wind: wind && [[scaled(wind, scene.arrow_s), [0, 0, -1.7 * scene.reach_m]]],
        velocity: velocity && [[scaled(velocity, scene.arrow_s), [0, 0, 0]]],
      },
    };
  };
  /** The matrix of a frame at a state, or null where there is nothing to see; vehicles may be drawn larger than they are. */
  const frameOf = (flight, state, origin, on, larger) => {
    const here = state.place.map((x, k) => x - origin[k]);
    const body = columns(...state.axes.map((axis) => scaled(axis, larger)), here);
    const [what, part, which] = on.split(".");
    const down = scene.ground_m - state.place[2];
    if (on === "world") return moved(origin.map((x) => -x));
    if (on === "body") return body;
    if (on === "shadow") {
      const place = [here[0], here[1], scene.ground_m - origin[2] - 0.002 * scene.reach_m];
      return columns([larger, 0, 0], [0, larger, 0], [0, 0, 1], place);
    }
    if (on === "drop") return down > 0 ? columns([larger, 0, 0], [0, larger, 0], [0, 0, down], here) : null;
    if (on === "reference") return state.reference && columns([larger, 0, 0], [0, larger, 0], [0, 0, larger], state.reference.map((x, k) => x - origin[k]));
    if (what === "rotor") {
      const { hub_body_m: hub, spin } = flight.body.rotors[+part];
      return times(body, turned(0.6 + 1.3 * +part + (state.turns ? spin * state.turns[+part] : 0), hub));
    }
    if (what === "left" || what === "right") {
      const [wing, side] = [flight.body.wing, what === "right" ? 1 : -1];
      const angle = ((wing.folded_deg + state.cranks[what === "right" ? 1 : 0]) * Math.PI) / 180;
      const crank = [-Math.cos(angle), side * Math.sin(angle), 0];
      const [x, y, z] = wing.root_body_m;
      const root = (ahead) => [x + ahead * wing.chord_m, side * y, z];
      if (part === "skin") return times(body, columns([wing.chord_m, 0, 0], scaled(crank, wing.span_m), [0, 0, 1], root(0)));
      if (part === "edge") return times(body, moved(root(0).map((p, k) => p + wing.span_m * crank[k])));
      return times(body, columns(crank, [-crank[1], crank[0], 0], [0, 0, 1], root(part === "front" ? 0.5 : -0.5)));
    }
    const [arrow, start] = (state.arrows[what] || [])[+which] || [[0, 0, 0], [0, 0, 0]];
    const length = larger * Math.hypot(...arrow);
    const size = larger * scene.reach_m;
    if (!(length > 0.04 * size) || !shown.has(what)) return null;
    const z = unit(arrow);
    const x = unit(cross(Math.abs(z[0]) < 0.7 ? [1, 0, 0] : [0, 1, 0], z));
    const y = cross(z, x);
    const tip = Math.min(0.26 * size, 0.5 * length);
    const wide = part === "head" ? 0.38 * tip : 0.035 * size;
    const from = here.map((p, k) => p + larger * start[k] + (part === "head" ? z[k] * (length - tip) : 0));
    return columns(scaled(x, wide), scaled(y, wide), scaled(z, part === "head" ? tip : length - tip), from);
  };

  // Colours are those of the style sheet, by day and by night.
  let inks = {};
  const readInks = () => {
    const [probe, context] = [getComputedStyle(document.documentElement), document.createElement("canvas").getContext("2d", { willReadFrequently: true })];
    const ink = (name) => {
      context.fillStyle = probe.getPropertyValue(name).trim() || "#888";
      context.fillRect(0, 0, 1, 1);
      return [...context.getImageData(0, 0, 1, 1).data].slice(0, 3).map((c) => c / 255);
    };
    inks = Object.fromEntries(["s0", "s1", "s2", "s3", "s4", "s5", "muted", "ink", "block", "hull", "frame"].map((name) =>
      [name, ink("--" + (name === "hull" || name === "frame" ? "view-" + name : name))]));
  };

  const renderer = makeRenderer(canvas, scene.meshes);
  find("#no-gl").hidden = Boolean(renderer);
  canvas.hidden = !renderer;
  for (const flight of renderer ? scene.flights : []) {
    flight.lines = ["reference", "position"].filter((name) => flight.tracks[name]).map((name) => {
      const { values } = flight.tracks[name];
      const first = [0, 1, 2].map((k) => (values.find((x, i) => i % 3 === k && !Number.isNaN(x)) || 0));
      const points = new Float32Array(flight.clock.count * 4);
      let along = 0;
      for (let k = 0; k < flight.clock.count; k++) {
        const p = [0, 1, 2].map((c) => values[3 * k + c] - first[c]);
        if (k > 0 && name === "reference") along += Math.hypot(...[0, 1, 2].map((c) => values[3 * k + c] - values[3 * k - 3 + c])) || 0;
        const s = name === "reference" ? along : k / flight.clock.rate_hz;
        points.set(Number.isNaN(p[0]) ? [0, 0, 0, -1e9] : [...p, s], 4 * k);
      }
      return { name, first, line: renderer.line(points) };
    });
  }

  // The camera turns around a place; angles in radians, distance in m.
  const shown = new Set();
  const eye = { azimuth: NaN, elevation: 0.42, distance: 0 };
  const box = (() => {
    const all = scene.flights.map((flight) => flight.tracks.position).filter(Boolean).flatMap((track) => [...track.values]);
    return [0, 1, 2].map((k) => {
      const own = all.filter((x, i) => i % 3 === k && !Number.isNaN(x));
      return own.reduce(([lo, hi], x) => [Math.min(lo, x), Math.max(hi, x)], [Infinity, -Infinity]).map((x) => (Number.isFinite(x) ? x : 0));
    });
  })();
  const setCamera = (kind) => {
    const course = scene.flights.map((flight) => at(flight, "velocity", begin + 0.3 * (end - begin))).find(Boolean);
    if (Number.isNaN(eye.azimuth)) eye.azimuth = (course && Math.hypot(course[0], course[1]) > 0.3 ? Math.atan2(course[1], course[0]) : 0) + 0.7;
    const span = Math.max(...box.map(([lo, hi]) => hi - lo), 4 * scene.reach_m);
    eye.distance = kind === "follow" ? 6.5 * scene.reach_m : 1.2 * span;
    eye.elevation = kind === "above" ? 1.5 : kind === "whole" ? 0.6 : 0.42;
  };

  let [now, playing, last] = [begin, false, 0];
  const draw = () => {
    const states = scene.flights.map((flight) => stateOf(flight, now));
    readings(states);
    if (!renderer) return;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.max(1, Math.round(x * ratio)));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    renderer.clear();
    const beside = scene.flights.length > 1 && layout.value === "beside";
    const views = beside ? scene.flights.map((_, i) => [i]) : [scene.flights.map((_, i) => i)];
    const part = Math.floor(width / views.length);
    views.forEach((who, v) => show(who, states, [v * part, 0, part, height], ratio));
    const { triangles, calls } = renderer.counted;
    find("#count").textContent = `${triangles} triangles in ${calls} draw calls this frame; ${scene.triangles} in ${scene.draw_calls} with everything shown`;
    document.body.dataset.drawn = `${now.toFixed(3)} ${triangles} ${calls}`;
  };
  const show = (who, states, area, ratio) => {
    const origin = camera.value === "follow" ? states[who[0]].place : box.map(([lo, hi]) => (lo + hi) / 2);
    const [ca, sa, ce, se] = [Math.cos(eye.azimuth), Math.sin(eye.azimuth), Math.cos(eye.elevation), Math.sin(eye.elevation)];
    const from = [-eye.distance * ce * ca, -eye.distance * ce * sa, -eye.distance * se];
    const forward = unit(scaled(from, -1));
    const right = unit(cross(forward, [0, 0, -1]));
    const up = cross(right, forward);
    const [aspect, near, far] = [area[2] / area[3], 0.05 * eye.distance, 60 * eye.distance + 300];
    // A narrow view sees as much across as a square one.
    const f = 2.6 * Math.min(1, aspect);
    const [a, b] = [(far + near) / (near - far), (2 * far * near) / (near - far)];
    const projected = (v, w) => [f / aspect * v[0], f * v[1], a * v[2] + (w ? b : 0), -v[2]];
    const seen = (v) => [dot(right, v), dot(up, v), -dot(forward, v)];
    const matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].flatMap((axis) => projected(seen(axis), false)).concat(projected(seen(scaled(from, -1)), true));
    // From far away a vehicle is a dot: there it is drawn larger, and the page says so.
    const larger = camera.value === "follow" ? 1 : Math.max(1, (0.028 * eye.distance) / scene.reach_m);
    find("#larger").textContent = larger > 1 ? ` The vehicle is drawn ${larger.toFixed(0)} times as large as it is.` : "";
    const reach = 9 * eye.distance + 8 * scene.cell_m;
    const down = scene.ground_m - origin[2];
    const [n, e] = [0, 1].map((k) => origin[k] - Math.floor(origin[k] / (10 * scene.cell_m)) * 10 * scene.cell_m);
    const items = [{
      mesh: "sheet", model: gridModel(reach, down), ink: [...inks.ink, 0.55], ground: { offset: [n, e], cell: scene.cell_m, reach },
    }];
    for (const i of who) {
      const [flight, state] = [scene.flights[i], states[i]];
      for (const { name, first, line } of flight.lines) {
        const own = name === "position";
        items.push({
          line, shift: origin.map((x, k) => x - first[k]), width: (own ? 2.2 : 1.3) * ratio, dash: own ? 0 : 2.5 * scene.reach_m,
          ink: [...(own ? inks["s" + i] : inks.ink), own ? 0.95 : 0.5], now: own ? now + flight.shift_s - flight.clock.begin_s : 1e9,
        });
      }
      const frames = {};
      for (const piece of flight.pieces) {
        const on = piece.on;
        if (!(on in frames)) frames[on] = frameOf(flight, state, origin, on, larger);
        if (!frames[on]) continue;
        const m = times(frames[on], piece.at);
        const model = [m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0, m[3], m[7], m[11], 1];
        const ink = inks[piece.ink === "own" ? "s" + i : piece.ink];
        const alpha = on === "world" && hides(m, from, state.place.map((x, k) => x - origin[k])) ? 0.14 : piece.alpha;
        items.push({ mesh: piece.mesh, model, ink: [...ink, alpha], lit: on === "shadow" || on === "drop" ? 0 : 1 });
      }
    }
    // What hides goes first; of the rest the ground, which is below.
    const order = (item) => (item.ground ? 1 : item.ink[3] === 1 ? 0 : 2);
    items.sort((p, q) => order(p) - order(q));
    renderer.view(area, matrix, from, items);
  };
  /** Whether a trunk stands between the eye and a vehicle, or around one of them. */
  const hides = (m, from, to) => {
    const [radius, n, e] = [Math.hypot(m[0], m[4]), m[3], m[7]];
    const [dn, de] = [to[0] - from[0], to[1] - from[1]];
    const share = clamp(((n - from[0]) * dn + (e - from[1]) * de) / (dn * dn + de * de || 1), 0, 1);
    return Math.hypot(from[0] + share * dn - n, from[1] + share * de - e) < 1.05 * radius + scene.reach_m;
  };
  const gridModel = (reach, down) => [2 * reach, 0, 0, 0, 0, 2 * reach, 0, 0, 0, 0, 0, 0, 0, -reach, down, 1];

  // Numbers of the instant.
  const table = find("#readings");
  const readings = (states) => {
    const number = (x, digits) => (x === null || x === undefined || Number.isNaN(x) ? "\u2013" : x.toFixed(digits).replace(/^-(0\.?0*)$/, "$1"));
    const head = ["", "left wing", "right wing", "speed m/s", "height m", "tilt deg", "thrust N"];
    const rows = states.map((state, i) => {
      const wing = (k) => (state.share && state.cranks ? `${number(100 * state.share[k], 0)} %, ${number(state.cranks[k], 0)}\u00b0` : "\u2013");
      return [scene.flights[i].name, wing(0), wing(1), number(state.velocity && Math.hypot(...state.velocity), 2),
        scene.flights[i].tracks.position ? number(-state.place[2], 2) : "\u2013",
        scene.flights[i].tracks.attitude ? number((Math.acos(clamp(state.axes[2][2], -1, 1)) * 180) / Math.PI, 1) : "\u2013", number(state.thrust, 2)];
    });
    const line = (cells, tag) => {
      const row = document.createElement("tr");
      for (const text of cells) row.appendChild(document.createElement(tag)).textContent = text;
      return row;
    };
    table.replaceChildren(line(head, "th"), ...rows.map((cells) => line(cells, "td")));
    find("#now").textContent = now.toFixed(2) + " s";
  };

  const setTime = (t) => {
    now = clamp(t, begin, end);
    slider.value = now;
    document.dispatchEvent(new CustomEvent("squirrel:time", { detail: now }));
    draw();
  };
  const setPlaying = (on) => {
    playing = on;
    play.textContent = on ? "\u23f8" : "\u25b6";
    play.setAttribute("aria-label", on ? "pause" : "play");
    last = performance.now();
    if (on && now >= end) setTime(begin);
    if (on) requestAnimationFrame(tick);
  };
  const tick = (stamp) => {
    if (!playing) return;
    const t = now + Math.max(0, stamp - last) * 1e-3 * Number(find("#pace").value);
    last = stamp;
    setTime(t);
    if (t >= end) setPlaying(false);
    else requestAnimationFrame(tick);
  };

  slider.addEventListener("input", () => setTime(+slider.value));
  slider.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 }[event.key];
    if (!step) return;
    event.preventDefault();
    setTime(now + step / scene.flights[0].clock.rate_hz);
  });
  play.addEventListener("click", () => setPlaying(!playing));
  document.addEventListener("squirrel:pick", (event) => setTime(event.detail));
  camera.addEventListener("change", () => (setCamera(camera.value), draw()));
  if (layout) layout.addEventListener("change", draw);
  for (const input of document.querySelectorAll("input[name=arrow]")) {
    const set = () => (input.checked ? shown.add(input.value) : shown.delete(input.value));
    input.addEventListener("change", () => (set(), draw()));
    set();
  }
  const turn = (right, up) => {
    eye.azimuth -= right;
    eye.elevation = clamp(eye.elevation + up, -0.2, 1.55);
    draw();
  };
  const zoom = (factor) => {
    eye.distance = clamp(eye.distance * factor, 2 * scene.reach_m, 1e4 * scene.reach_m);
    draw();
  };
  const fingers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => fingers.delete(event.pointerId));
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
  canvas.addEventListener("keydown", (event) => {
    const act = {
      ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.08), ArrowDown: () => turn(0, -0.08),
      "+": () => zoom(0.85), "=": () => zoom(0.85), "-": () => zoom(1.18), " ": () => setPlaying(!playing),
    }[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });

  // The address may say when and from where: #t=2.5&camera=whole&azimuth=40&elevation=20&distance=3&layout=one.
  const follow = () => {
    const asked = new URLSearchParams(location.hash.slice(1));
    const number = (name, use) => Number.isFinite(parseFloat(asked.get(name))) && use(parseFloat(asked.get(name)));
    const choose = (list, name) => {
      if (list && [...list.options].some((option) => option.value === asked.get(name))) list.value = asked.get(name);
    };
    choose(camera, "camera");
    choose(layout, "layout");
    if (asked.has("camera")) setCamera(camera.value);
    number("azimuth", (x) => (eye.azimuth = (x * Math.PI) / 180));
    number("elevation", (x) => (eye.elevation = clamp((x * Math.PI) / 180, -0.2, 1.55)));
    number("distance", (x) => (eye.distance = clamp(x, 2 * scene.reach_m, 1e4 * scene.reach_m)));
    setPlaying(false);
    setTime(asked.has("t") ? parseFloat(asked.get("t")) || begin : now);
  };
  readInks();
  setCamera("follow");
  follow();
  addEventListener("hashchange", follow);
  addEventListener("resize", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => (readInks(), draw()));
}
