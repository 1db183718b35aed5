// Draws triangles, thick lines and the ground with WebGL 2. Matrices are columns of four; places are relative to what
// the camera looks at, so that a far flight keeps its digits.
const makeRenderer = (canvas, meshes) => {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
  if (!gl) return null;
  const program = (vertex, fragment) => {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, "#version 300 es\nprecision highp float;\n" + text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    const places = {};
    for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i++) {
      const { name } = gl.getActiveUniform(made, i);
      places[name] = gl.getUniformLocation(made, name);
    }
    return { made, at: places };
  };

  // A face's normal comes from its depth: shapes carry corners only, and both sides are lit.
  const solid = program(
    `in vec3 corner; uniform mat4 model, camera; out vec3 seen;
     void main() { vec4 p = model * vec4(corner, 1.0); seen = p.xyz; gl_Position = camera * p; }`,
    `in vec3 seen; uniform vec4 ink; uniform vec3 eye; uniform float lit; out vec4 colour;
     void main() {
       vec3 n = normalize(cross(dFdx(seen), dFdy(seen)));
       vec3 ray = normalize(eye - seen);
       if (dot(n, ray) < 0.0) n = -n;
       float sun = max(dot(n, normalize(vec3(-0.45, -0.5, -0.9))), 0.0);
       float shine = pow(max(dot(n, normalize(ray + normalize(vec3(-0.45, -0.5, -0.9)))), 0.0), 40.0);
       float light = mix(1.0, 0.52 - 0.14 * n.z + 0.42 * sun, lit);
       colour = vec4((ink.rgb * light + 0.12 * lit * shine) * ink.a, ink.a);
     }`,
  );
  // Each segment is a strip of two triangles as wide as a number of pixels.
  const thick = program(
    `in vec4 a, b; uniform vec3 shift; uniform mat4 camera; uniform vec2 size; uniform float width; out float s;
     void main() {
       vec4 p = camera * vec4(a.xyz - shift, 1.0), q = camera * vec4(b.xyz - shift, 1.0);
       float near = 0.01;
       bool gap = a.w < -1e8 || b.w < -1e8 || (p.w < near && q.w < near);
       if (p.w < near) p = mix(p, q, (near - p.w) / (q.w - p.w));
       if (q.w < near) q = mix(q, p, (near - q.w) / (p.w - q.w));
       vec2 along = (q.xy / q.w - p.xy / p.w) * size;
       float apart = length(along);
       along = apart > 1e-6 ? along / apart : vec2(1.0, 0.0);
       bool first = gl_VertexID < 2;
       vec4 c = first ? p : q;
       float side = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
       c.xy += (vec2(-along.y, along.x) * side + along * (first ? -0.5 : 0.5)) * width / size * c.w;
       s = first ? a.w : b.w;
       gl_Position = gap ? vec4(2.0, 2.0, 2.0, 1.0) : c;
     }`,
    `in float s; uniform vec4 ink; uniform float now, dash; out vec4 colour;
     void main() {
       if (dash > 0.0 && fract(s / dash) > 0.5) discard;
       float a = ink.a * (s <= now ? 1.0 : 0.3);
       colour = vec4(ink.rgb * a, a);
     }`,
  );
  const ground = program(
    `in vec3 corner; uniform mat4 model, camera; out vec3 seen;
     void main() { vec4 p = model * vec4(corner, 1.0); seen = p.xyz; gl_Position = camera * p; }`,
    `in vec3 seen; uniform vec4 ink; uniform vec2 offset; uniform float cell, reach; out vec4 colour;
     float lines(vec2 p) {
       vec2 wide = fwidth(p), off = abs(fract(p - 0.5) - 0.5) / max(wide, 1e-6);
       return (1.0 - min(min(off.x, off.y) / 1.2, 1.0)) * (1.0 - smoothstep(0.06, 0.3, max(wide.x, wide.y)));
     }
     void main() {
       vec2 p = (seen.xy + offset) / cell;
       float fade = 1.0 - smoothstep(0.25, 1.0, length(seen.xy) / reach);
       float a = fade * ink.a * (0.1 + 0.4 * lines(p) + 0.5 * lines(p / 10.0));
       colour = vec4(ink.rgb * a, a);
     }`,
  );

  const shapes = {};
  for (const [name, corners] of Object.entries(meshes)) {
    const [array, buffer] = [gl.createVertexArray(), gl.createBuffer()];
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(corners), gl.STATIC_DRAW);
    for (const { made } of [solid, ground]) {
      const place = gl.getAttribLocation(made, "corner");
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    }
    shapes[name] = { array, corners: corners.length / 3 };
  }

  gl.enable(gl.DEPTH_TEST);
  gl.depthFunc(gl.LEQUAL);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  const counted = { triangles: 0, calls: 0 };
  const count = (triangles) => {
    counted.triangles += triangles;
    counted.calls += 1;
  };
  return {
    counted,
    /** A line through points of four numbers: place and what its dashes and its present are measured by. */
    line(points) {
      const [array, buffer] = [gl.createVertexArray(), gl.createBuffer()];
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, points, gl.STATIC_DRAW);
      for (const [name, offset] of [["a", 0], ["b", 16]]) {
        const place = gl.getAttribLocation(thick.made, name);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, 4, gl.FLOAT, false, 16, offset);
        gl.vertexAttribDivisor(place, 1);
      }
      return { array, segments: points.length / 4 - 1 };
    },
    clear() {
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.disable(gl.SCISSOR_TEST);
      gl.depthMask(true);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      counted.triangles = counted.calls = 0;
    },
    /** Draws a list into a part of the canvas, in its order; what is transparent hides nothing. */
    view([x, y, width, height], camera, eye, items) {
      gl.viewport(x, y, width, height);
      for (const { made, at } of [solid, thick, ground]) {
        gl.useProgram(made);
        gl.uniformMatrix4fv(at.camera, false, camera);
        if (at.eye) gl.uniform3fv(at.eye, eye);
        if (at.size) gl.uniform2f(at.size, width, height);
      }
      for (const item of items) {
        gl.depthMask(item.ink[3] === 1);
        if (item.line) {
          gl.useProgram(thick.made);
          gl.bindVertexArray(item.line.array);
          gl.uniform4fv(thick.at.ink, item.ink);
          gl.uniform3fv(thick.at.shift, item.shift);
          gl.uniform1f(thick.at.width, item.width);
          gl.uniform1f(thick.at.dash, item.dash);
          gl.uniform1f(thick.at.now, item.now);
          gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, item.line.segments);
          count(2 * item.line.segments);
          continue;
        }
        const { made, at } = item.ground ? ground : solid;
        gl.useProgram(made);
        if (item.ground) {
          gl.uniform2fv(at.offset, item.ground.offset);
          gl.uniform1f(at.cell, item.ground.cell);
          gl.uniform1f(at.reach, item.ground.reach);
        } else {
          gl.uniform1f(at.lit, item.lit);
        }
        gl.uniformMatrix4fv(at.model, false, item.model);
        gl.uniform4fv(at.ink, item.ink);
        const { array, corners } = shapes[item.mesh];
        gl.bindVertexArray(array);
        gl.drawArrays(gl.TRIANGLES, 0, corners);
        count(corners / 3);
      }
    },
  };
};
