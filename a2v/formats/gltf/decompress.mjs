// Decode the arrays of a GLB that are compressed by Draco or meshopt: node decompress.mjs in.glb out.glb, beside a node_modules with draco3dgltf and meshoptimizer.
// All else of the file, such as the extensions of a VRM, stays as it is. Only the bytes of the file are read.
import { readFileSync, writeFileSync } from "node:fs";
import draco3d from "draco3dgltf";
import { MeshoptDecoder } from "meshoptimizer";

const DRACO = "KHR_draco_mesh_compression", MESHOPT = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
const MOST = 1 << 30;  // bytes that may be unpacked
const KINDS = { 5120: ["DT_INT8", Int8Array], 5121: ["DT_UINT8", Uint8Array], 5122: ["DT_INT16", Int16Array], 5123: ["DT_UINT16", Uint16Array], 5125: ["DT_UINT32", Uint32Array], 5126: ["DT_FLOAT32", Float32Array] };
const [source, target] = process.argv.slice(2);
const file = readFileSync(source), length = file.readUInt32LE(12), gltf = JSON.parse(file.toString("utf8", 20, 20 + length)), binary = new Uint8Array(file.subarray(28 + length));
const primitives = (gltf.meshes || []).flatMap(mesh => mesh.primitives), views = gltf.bufferViews || [], parts = [];
let size = 0;

/** Append bytes; their place. */
function keep(bytes) {
  const at = size, rest = -bytes.byteLength & 3;
  parts.push(new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength), new Uint8Array(rest));
  size += bytes.byteLength + rest;
  if (size > MOST) throw new Error("it unpacks to more than 1 GB");
  return { buffer: 0, byteOffset: at, byteLength: bytes.byteLength };
}

function within(part) {
  const bytes = binary.subarray(part.byteOffset || 0, (part.byteOffset || 0) + part.byteLength);
  if (bytes.length !== part.byteLength) throw new Error("its arrays are cut off");
  return bytes;
}

/** The indices and attributes of a primitive. */
function unpack(primitive, draco, decoder) {
  const { bufferView, attributes } = primitive.extensions[DRACO], bytes = new Int8Array(within(views[bufferView])), buffer = new draco.DecoderBuffer(), mesh = new draco.Mesh();
  buffer.Init(bytes, bytes.length);
  if (!decoder.DecodeBufferToMesh(buffer, mesh).ok()) throw new Error("its mesh cannot be decoded");
  const fill = (index, count, width, read) => {
    const accessor = gltf.accessors[index], [name, Kind] = KINDS[accessor.componentType];
    if (accessor.count !== count) throw new Error(`its mesh has ${count} points or corners, not ${accessor.count}`);
    const bytes = count * width * Kind.BYTES_PER_ELEMENT;
    if (size + bytes > MOST) throw new Error("it unpacks to more than 1 GB");
    const at = draco._malloc(bytes);
    if (!read(draco[name], bytes, at)) throw new Error("its mesh cannot be decoded");
    const made = new Uint8Array(draco.HEAPU8.buffer, at, bytes), row = width * Kind.BYTES_PER_ELEMENT, stride = row + (-row & 3), rows = new Uint8Array(count * stride);
    for (let point = 0; point < count; point++) rows.set(made.subarray(point * row, (point + 1) * row), point * stride);
    accessor.bufferView = gltf.bufferViews.push({ ...keep(rows), byteStride: stride }) - 1;
    delete accessor.byteOffset;
    draco._free(at);
  };
  const corners = 3 * mesh.num_faces(), wide = new Uint32Array(corners), at = draco._malloc(4 * corners);
  decoder.GetTrianglesUInt32Array(mesh, 4 * corners, at);
  wide.set(new Uint32Array(draco.HEAPU8.buffer, at, corners));
  draco._free(at);
  const accessor = gltf.accessors[primitive.indices], own = KINDS[accessor.componentType][1].from(wide);
  if (accessor.count !== corners) throw new Error(`its mesh has ${corners} corners, not ${accessor.count}`);
  accessor.bufferView = gltf.bufferViews.push(keep(own)) - 1;
  delete accessor.byteOffset;
  for (const [name, id] of Object.entries(attributes)) {
    const attribute = decoder.GetAttributeByUniqueId(mesh, id);
    fill(primitive.attributes[name], mesh.num_points(), attribute.num_components(), (kind, bytes, at) => decoder.GetAttributeDataArrayForAllPoints(mesh, attribute, kind, bytes, at));
  }
  delete primitive.extensions[DRACO];
  draco.destroy(mesh);
  draco.destroy(buffer);
}

const packed = primitives.filter(one => one.extensions && one.extensions[DRACO]), own = views.map(view => ({ ...view })), drawn = new Set(packed.map(one => one.extensions[DRACO].bufferView));
await MeshoptDecoder.ready;
if (packed.length) {
  const draco = await draco3d.createDecoderModule(), decoder = new draco.Decoder();
  for (const primitive of packed) unpack(primitive, draco, decoder);
}
own.forEach((view, index) => {
  const kind = MESHOPT.find(name => view.extensions && view.extensions[name]), how = kind && view.extensions[kind];
  if (how && size + how.count * how.byteStride > MOST) throw new Error("it unpacks to more than 1 GB");
  const bytes = how ? new Uint8Array(how.count * how.byteStride) : drawn.has(index) ? new Uint8Array(4) : within(view);
  if (how) {
    MeshoptDecoder.decodeGltfBuffer(bytes, how.count, how.byteStride, within(how), how.mode, how.filter);
    delete view.extensions;
  }
  gltf.bufferViews[index] = { ...view, ...keep(bytes) };
});
for (const name of ["extensionsUsed", "extensionsRequired"]) if (gltf[name]) gltf[name] = gltf[name].filter(one => one !== DRACO && !MESHOPT.includes(one));
gltf.buffers = [{ byteLength: size }];
const text = Buffer.from(JSON.stringify(gltf)), pad = -text.length & 3, head = Buffer.alloc(20), mark = Buffer.alloc(8);
head.write("glTF", 0, "latin1");
[2, 28 + text.length + pad + size, text.length + pad].forEach((value, index) => head.writeUInt32LE(value, 4 + 4 * index));
head.write("JSON", 16, "latin1");
mark.writeUInt32LE(size, 0);
mark.write("BIN\0", 4, "latin1");
writeFileSync(target, Buffer.concat([head, text, Buffer.alloc(pad, 32), mark, ...parts]));
