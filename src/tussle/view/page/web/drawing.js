// Programs and buffers of WebGL 2.

/** A program with the places of its uniforms by name. */
export function program(gl, corners, paint) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, corners], [gl.FRAGMENT_SHADER, paint]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(made));
  const places = {};
  const n = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS);
  for (let i = 0; i < n; i++) {
    const { name } = gl.getActiveUniform(made, i);
    places[name] = gl.getUniformLocation(made, name);
  }
  return { made, places };
}

/** Use a program with values: numbers, or lists of two, three or sixteen. */
export function use(gl, { made, places }, values) {
  gl.useProgram(made);
  for (const [name, value] of Object.entries(values)) {
    const place = places[name];
    if (place === undefined) continue;
    if (typeof value === 'number') gl.uniform1f(place, value);
    else if (value.length === 2) gl.uniform2fv(place, value);
    else if (value.length === 3) gl.uniform3fv(place, value);
    else gl.uniformMatrix4fv(place, false, value);
  }
}

export function buffer(gl, data, target = gl.ARRAY_BUFFER) {
  const made = gl.createBuffer();
  gl.bindBuffer(target, made);
  gl.bufferData(target, data, gl.STATIC_DRAW);
  return made;
}

/** Tell where an attribute lies in the bound buffer. */
export function attribute(gl, place, size, kind, stride, offset, divisor = 0) {
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, size, kind, kind === gl.UNSIGNED_BYTE, stride, offset);
  gl.vertexAttribDivisor(place, divisor);
}

/** A square from -1 to 1, as two triangles. */
export function square(gl) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  buffer(gl, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]));
  attribute(gl, 0, 2, gl.FLOAT, 0, 0);
  gl.bindVertexArray(null);
  return array;
}

/** A colour of the page's style as three numbers from 0 to 1. */
export function styled(name) {
  const text = getComputedStyle(document.body).getPropertyValue(name).trim();
  return [1, 3, 5].map((i) => parseInt(text.slice(i, i + 2), 16) / 255);
}
