// Khronos' validator on one file: prints {errors, warnings, messages} as JSON. Usage: node validate_gltf.js <node_modules> <file.glb>
const fs = require("fs");
const path = require("path");
const validator = require(path.join(process.argv[2], "gltf-validator"));
validator
  .validateBytes(new Uint8Array(fs.readFileSync(process.argv[3])), { maxIssues: 100 })
  .then((report) => {
    const { numErrors, numWarnings, messages } = report.issues;
    console.log(JSON.stringify({ errors: numErrors, warnings: numWarnings, messages, info: report.info }));
  });
