#!/usr/bin/env bash
# Makes a2v/formats/fbx_writer.mjs out of scripts/fbx_writer.mjs and its packages (npm; MIT licences, their notices stay inside).
set -euo pipefail
cd "$(dirname "$0")/.."
folder=build/fbx-writer
mkdir -p "$folder"
npm install --no-audit --no-fund --silent --prefix "$folder" three@0.184.0 @comfyorg/fbx-exporter-three@1.0.1 esbuild@0.28.2
cp scripts/fbx_writer.mjs "$folder/"
{
  echo "// Made by scripts/bundle_fbx_writer.sh; not to be edited. Licences of what is inside:"
  for name in three @comfyorg/fbx-exporter-three fflate; do
    echo "// --- $name $(node -p "require('./$folder/node_modules/$name/package.json').version")"
    sed 's|^|// |; s| *$||' "$folder/node_modules/$name/LICENSE"
    echo
  done
  "$folder/node_modules/.bin/esbuild" "$folder/fbx_writer.mjs" --bundle --minify --platform=node --format=esm --legal-comments=none --log-level=error
} >a2v/formats/fbx_writer.mjs.tmp
mv a2v/formats/fbx_writer.mjs.tmp a2v/formats/fbx_writer.mjs
