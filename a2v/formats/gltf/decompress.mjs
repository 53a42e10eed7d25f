// Decode a GLB that is compressed by Draco or meshopt: node decompress.mjs in.glb out.glb, beside a node_modules that holds glTF Transform.
// Only the bytes of the file are read: readBinary refuses buffers and pictures outside of it.
import { readFileSync, writeFileSync } from "node:fs";
import { NodeIO } from "@gltf-transform/core";
import { ALL_EXTENSIONS } from "@gltf-transform/extensions";
import draco3d from "draco3dgltf";
import { MeshoptDecoder } from "meshoptimizer";

const KINDS = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];
const [source, target] = process.argv.slice(2);
await MeshoptDecoder.ready;
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
  "draco3d.decoder": await draco3d.createDecoderModule(),
  "meshopt.decoder": MeshoptDecoder,
});
const document = await io.readBinary(new Uint8Array(readFileSync(source)));
for (const extension of document.getRoot().listExtensionsUsed()) if (KINDS.includes(extension.extensionName)) extension.dispose();
writeFileSync(target, await io.writeBinary(document));
