// Validates WGSL with Tint, the compiler behind WebGPU in Chromium, without any graphics driver.
//
//   node check.mjs PATH...      a path is a .wgsl file or a folder, which is searched with its subfolders
//
// Prints one line a diagnostic, `file:line:column: error: message`, and a closing count.
// Exit code 0: no errors; 1: errors; 2: the check could not run.
//
// The npm package `webgpu` is looked for in the folder that VEDUTA_TINT_DIR names, else in target/tint of this
// repository; `cargo xtask test` installs it there.

import { createRequire } from 'node:module';
import { existsSync, readFileSync, readdirSync, statSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

function giveUp(message) {
  console.error(`tint: ${message}`);
  process.exit(2);
}

function wgslFiles(path) {
  if (!existsSync(path)) giveUp(`${path} does not exist`);
  if (!statSync(path).isDirectory()) return [path];
  return readdirSync(path)
    .sort()
    .map((name) => join(path, name))
    .flatMap((p) => (statSync(p).isDirectory() ? wgslFiles(p) : p.endsWith('.wgsl') ? [p] : []));
}

async function loadWebGpu() {
  const here = dirname(fileURLToPath(import.meta.url));
  const folder = resolve(process.env.VEDUTA_TINT_DIR ?? join(here, '..', '..', 'target', 'tint'));
  let entry;
  try {
    entry = createRequire(join(folder, 'package.json')).resolve('webgpu');
  } catch {
    giveUp(`the npm package webgpu is not installed in ${folder}; run \`cargo xtask test\``);
  }
  return import(pathToFileURL(entry).href);
}

const paths = process.argv.slice(2);
if (paths.length === 0) giveUp('name .wgsl files or folders');
const files = paths.flatMap(wgslFiles);
if (files.length === 0) giveUp(`no .wgsl file in ${paths.join(', ')}`);

const { create } = await loadWebGpu();
// The instance has to stay reachable for as long as anything of it is used: a collected instance crashes the process.
globalThis.gpu = create(['backend=null']);
const adapter = await globalThis.gpu.requestAdapter();
if (!adapter) giveUp('the null adapter is missing');
const wanted = ['shader-f16', 'subgroups', 'timestamp-query', 'float32-filterable'];
const device = await adapter.requestDevice({
  requiredFeatures: wanted.filter((feature) => adapter.features.has(feature)),
});

let errors = 0;
for (const file of files) {
  device.pushErrorScope('validation');
  const module = device.createShaderModule({ label: file, code: readFileSync(file, 'utf8') });
  const { messages } = await module.getCompilationInfo();
  const failure = await device.popErrorScope();
  const before = errors;
  for (const m of messages) {
    if (m.type === 'error') errors += 1;
    console.log(`${file}:${m.lineNum}:${m.linePos}: ${m.type}: ${m.message}`);
  }
  if (failure && errors === before) {
    errors += 1;
    console.log(`${file}:1:1: error: ${failure.message}`);
  }
}
device.destroy();
delete globalThis.gpu;
console.log(`tint: ${files.length} files, ${errors} errors`);
process.exitCode = errors === 0 ? 0 : 1;
