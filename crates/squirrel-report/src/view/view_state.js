// Where each piece of a scene is at an instant. Places are north, east, down; a matrix is three
// rows of four numbers, the last of a row its place.
const vectors = {
  scaled: (a, s) => a.map((x) => x * s),
  sum: (a, b, s = 1) => a.map((x, k) => x + s * b[k]),
  dot: (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
  cross: (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
  unit: (a) => vectors.scaled(a, 1 / (Math.hypot(...a) || 1)),
  clamp: (x, lo, hi) => Math.min(Math.max(x, lo), hi),
};
const matrices = {
  /** From three axes and a place. */
  of: (x, y, z, p) => [0, 1, 2].flatMap((r) => [x[r], y[r], z[r], p[r]]),
  moved: (p) => matrices.of([1, 0, 0], [0, 1, 0], [0, 0, 1], p),
  sized: (s, p) => matrices.of([s[0], 0, 0], [0, s[1], 0], [0, 0, s[2]], p),
  turned: (angle, p) => {
    const [s, c] = [Math.sin(angle), Math.cos(angle)];
    return matrices.of([c, s, 0], [-s, c, 0], [0, 0, 1], p);
  },
  times: (m, n) => [0, 4, 8].flatMap((r) => [0, 1, 2, 3].map((c) =>
    m[r] * n[c] + m[r + 1] * n[4 + c] + m[r + 2] * n[8 + c] + (c === 3 ? m[r + 3] : 0))),
};

/** Rotors turn at this share of their speed, so that an eye can follow. */
const ROTOR_SHARE = 1 / 50;

/**
 * Reads the tracks of a scene: counts again from their differences, then numbers, NaN where the
 * log says nothing. Returns what is asked of a flight at a time of the page.
 */
const makeStates = (scene) => {
  const { scaled, sum, cross, unit, clamp } = vectors;
  const { of, moved, sized, turned, times } = matrices;
  for (const flight of scene.flights) {
    for (const track of Object.values(flight.tracks)) {
      const counts = new Array(track.width).fill(0);
      track.values = Float64Array.from(track.deltas, (delta, k) =>
        delta === null ? NaN : (counts[k % track.width] += delta) * track.step);
    }
    const speeds = flight.tracks.rotor_speed;
    if (!speeds) continue;
    const angles = Float64Array.from(speeds.values);
    const share = ROTOR_SHARE / flight.clock.rate_hz;
    angles.forEach((speed, k) => {
      angles[k] = (k < speeds.width ? 0 : angles[k - speeds.width]) + (speed || 0) * share;
    });
    flight.tracks.rotor_angle = { width: speeds.width, values: angles };
  }

  /** The numbers of a track at a time, between its instants on a line, or null. */
  const at = (flight, name, t) => {
    const track = flight.tracks[name];
    if (!track) return null;
    const { begin_s: first, rate_hz: rate, count } = flight.clock;
    const place = clamp((t + flight.shift_s - first) * rate, 0, count - 1);
    const i = Math.min(Math.floor(place + 1e-6), count - 1);
    const share = clamp(place - i, 0, 1);
    const row = (k) => Array.from(track.values.subarray(k * track.width, (k + 1) * track.width));
    const a = row(i);
    const b = share > 0 ? row(Math.min(i + 1, count - 1)) : a;
    // A quaternion and its negative are one attitude.
    const apart = name === "attitude" && a.reduce((all, x, k) => all + x * b[k], 0) < 0;
    const values = share > 0 ? a.map((x, k) => x + share * ((apart ? -1 : 1) * b[k] - x)) : a;
    return values.some(Number.isNaN) ? null : values;
  };

  /** The axes of a body in the world. */
  const axesOf = (q) => {
    const size = Math.hypot(...q) || 1;
    const [w, x, y, z] = q.map((c) => c / size);
    return [
      [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
      [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
      [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ];
  };

  /** Cranks of a wing: straight back at 0 deg, across at 90. */
  const crankOf = (wing, state, side) => {
    const angle = ((wing.folded_deg + state.swung_deg[side > 0 ? 1 : 0]) * Math.PI) / 180;
    return [-Math.cos(angle), side * Math.sin(angle), 0];
  };

  /** A flight at a time: its numbers, and arrows as pairs of a vector and where it begins. */
  const stateOf = (flight, t) => {
    const read = (name) => at(flight, name, t);
    const { wing, weight_n: weight, rotors } = flight.body;
    const axes = axesOf(read("attitude") || [1, 0, 0, 0]);
    const inWorld = (v) => [0, 1, 2].map((r) => axes[0][r] * v[0] + axes[1][r] * v[1] + axes[2][r] * v[2]);
    const [share, thrust, force, wind, velocity] =
      ["deployment", "thrust", "wing_force", "wind", "velocity"].map(read);
    const state = {
      axes, share, velocity,
      place: read("position") || [0, 0, 0],
      thrust: thrust && thrust.reduce((all, x) => all + x, 0),
      swung_deg: wing && (share || [0, 0]).map((d) => wing.stroke_deg * d),
      rotor_angle: read("rotor_angle"),
      reference: read("reference"),
    };
    const newton = scene.arrow_m_per_n;
    const wingCentre = (side) => {
      const [x, y, z] = wing.root_body_m;
      return [x, side * y + 0.5 * wing.span_m * crankOf(wing, state, side)[1], z];
    };
    const hub = (k) => (thrust.length > 1 ? rotors[k].hub_body_m : [0, 0, 0]);
    state.arrows = {
      thrust: thrust && thrust.map((x, k) => [scaled(axes[2], -x * newton), inWorld(hub(k))]),
      // The log has one force of both wings: half of it on each.
      wing_force: force && wing && [-1, 1].map((side) =>
        [scaled(inWorld(force), 0.5 * newton), inWorld(wingCentre(side))]),
      weight: weight && [[[0, 0, weight * newton], [0, 0, 0]]],
      // Air flows past above the vehicle.
      wind: wind && [[scaled(wind, scene.arrow_s), [0, 0, -1.7 * scene.reach_m]]],
      velocity: velocity && [[scaled(velocity, scene.arrow_s), [0, 0, 0]]],
    };
    return state;
  };

  const wingFrame = (wing, state, body, side, part) => {
    const crank = crankOf(wing, state, side);
    const [x, y, z] = wing.root_body_m;
    const root = (ahead) => [x + ahead * wing.chord_m, side * y, z];
    if (part === "skin") {
      return times(body, of([wing.chord_m, 0, 0], scaled(crank, wing.span_m), [0, 0, 1], root(0)));
    }
    if (part === "edge") return times(body, moved(sum(root(0), crank, wing.span_m)));
    const hinge = root(part === "front" ? 0.5 : -0.5);
    return times(body, of(crank, [-crank[1], crank[0], 0], [0, 0, 1], hinge));
  };

  const arrowFrame = ([vector, start], part, here, larger) => {
    const [length, size] = [larger * Math.hypot(...vector), larger * scene.reach_m];
    if (!(length > 0.04 * size)) return null;
    const z = unit(vector);
    const x = unit(cross(Math.abs(z[0]) < 0.7 ? [1, 0, 0] : [0, 1, 0], z));
    const tip = Math.min(0.26 * size, 0.5 * length);
    const head = part === "head";
    const wide = head ? 0.38 * tip : 0.035 * size;
    const from = sum(sum(here, start, larger), z, head ? length - tip : 0);
    return of(scaled(x, wide), scaled(cross(z, x), wide), scaled(z, head ? tip : length - tip), from);
  };

  /**
   * The matrix of a frame, or null where there is nothing to see. Places are relative to `origin`;
   * vehicles may be drawn larger than they are.
   */
  const frameOf = (flight, state, on, { origin, larger, shown }) => {
    const here = sum(state.place, origin, -1);
    const ground = scene.ground_m - state.place[2];
    const [what, part, which] = on.split(".");
    const body = () => of(...state.axes.map((axis) => scaled(axis, larger)), here);
    switch (what) {
      case "world": return moved(scaled(origin, -1));
      case "body": return body();
      case "shadow":
        return sized([larger, larger, 1], [here[0], here[1], here[2] + ground - 0.002 * scene.reach_m]);
      case "drop": return ground > 0 ? sized([larger, larger, ground], here) : null;
      case "reference":
        return state.reference && sized([larger, larger, larger], sum(state.reference, origin, -1));
      case "rotor": {
        const { hub_body_m: hub, spin } = flight.body.rotors[+part];
        const angle = state.rotor_angle ? spin * state.rotor_angle[+part] : 0;
        return times(body(), turned(0.6 + 1.3 * +part + angle, hub));
      }
      case "left": return wingFrame(flight.body.wing, state, body(), -1, part);
      case "right": return wingFrame(flight.body.wing, state, body(), 1, part);
      default: {
        const arrow = shown.has(what) && (state.arrows[what] || [])[+which];
        return arrow ? arrowFrame(arrow, part, here, larger) : null;
      }
    }
  };
  return { at, stateOf, frameOf };
};
