// A GLB apart, and together again.

export function partsOf(data) {
  const size = data.readUInt32LE(12);
  return { json: JSON.parse(data.subarray(20, 20 + size)), binary: data.subarray(20 + size + 8) };
}

export function glbOf(json, binary) {
  const text = Buffer.from(JSON.stringify(json));
  const [first, second] = [text, binary].map((part) => Math.ceil(part.length / 4) * 4);
  const glb = Buffer.alloc(28 + first + second);
  [0x46546c67, 2, glb.length, first, 0x4e4f534a].forEach((word, i) => glb.writeUInt32LE(word, 4 * i));
  glb.fill(" ", 20, 20 + first);
  text.copy(glb, 20);
  [second, 0x004e4942].forEach((word, i) => glb.writeUInt32LE(word, 20 + first + 4 * i));
  binary.copy(glb, 28 + first);
  return glb;
}
