// Builds the web client into a folder: messages from darm.proto, type check, bundle, page.
//   node build.mjs BUILD_FOLDER PROTOC [--test]      (BUILD_FOLDER has the node_modules of package-lock.json)
// The sources are copied there, so that they find those packages and nothing is written beside them.
import {execFileSync} from 'node:child_process';
import {cpSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {basename, dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';
import {brotliCompressSync, constants} from 'node:zlib';

const web = dirname(dirname(fileURLToPath(import.meta.url)));
const root = resolve(web, '../..');
const out = resolve(process.argv[2]);
const protoc = process.argv[3];
const forTests = process.argv.includes('--test');
const dist = join(out, 'dist');

function run(tool, ...args) {
  execFileSync(process.execPath, [join(out, 'node_modules', tool), ...args], {cwd: out, stdio: 'inherit'});
}

for (const folder of ['src', 'test']) {
  rmSync(join(out, folder), {recursive: true, force: true});
  cpSync(join(web, folder), join(out, folder), {recursive: true});
}
cpSync(join(web, 'tsconfig.json'), join(out, 'tsconfig.json'));
cpSync(join(root, 'client/core/glsl'), join(out, 'src/glsl'), {recursive: true});
mkdirSync(join(out, 'src/gen'), {recursive: true});
execFileSync(protoc, [`--plugin=protoc-gen-es=${join(out, 'node_modules/@bufbuild/protoc-gen-es/bin/protoc-gen-es')}`,
  `--es_out=${join(out, 'src/gen')}`, '--es_opt=target=ts', `--proto_path=${join(root, 'proto')}`, 'darm.proto'],
  {stdio: 'inherit'});
run('typescript/bin/tsc', '--project', out);

const esbuild = createRequire(join(out, 'package.json'))('esbuild');
const common = {absWorkingDir: out, bundle: true, format: 'esm', target: 'es2022', minify: true, logLevel: 'warning',
  loader: {'.glsl': 'text'}, legalComments: 'none'};

// Of what the bundle holds of others, as they ask for.
function licences() {
  const {dependencies} = JSON.parse(readFileSync(join(out, 'package.json'), 'utf8'));
  return Object.keys(dependencies).map((name) => {
    const folder = join(out, 'node_modules', name);
    const {version, license} = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
    const file = readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
    return `${name} ${version} (${license})\n\n${file ? readFileSync(join(folder, file), 'utf8') : ''}\n`;
  }).join('\n');
}

if (forTests) {
  rmSync(join(out, 'tests'), {recursive: true, force: true});
  const tests = readdirSync(join(out, 'test')).filter((name) => name.endsWith('.test.ts'));
  await esbuild.build({...common, minify: false, platform: 'node', outdir: join(out, 'tests'), sourcemap: 'inline',
    outExtension: {'.js': '.mjs'}, entryPoints: tests.map((name) => join('test', name))});
} else {
  rmSync(dist, {recursive: true, force: true});
  const named = async (entry, more = {}) => {
    const built = await esbuild.build({...common, ...more, entryPoints: [entry], outdir: dist, metafile: true,
      entryNames: '[name]-[hash]', chunkNames: '[name]-[hash]'});
    const outputs = Object.entries(built.metafile.outputs);
    const [file] = outputs.find(([, o]) => o.entryPoint === entry);
    return {file: basename(file), all: outputs.map(([name]) => basename(name))};
  };
  const worker = await named('src/worker/worker.ts');
  const start = await named('src/page/start.ts', {splitting: true, define: {WORKER_NAME: JSON.stringify(worker.file)}});
  cpSync(join(web, 'page'), join(out, 'page'), {recursive: true});
  const style = await named('page/style.css');
  const preloads = start.all.filter((name) => name !== start.file)
    .map((name) => `<link rel="modulepreload" href="${name}">`);
  const page = readFileSync(join(web, 'page/index.html'), 'utf8').replace('STYLE_NAME', style.file)
    .replace('START_NAME', start.file).replace('PRELOADS', preloads.join('\n'));
  cpSync(join(web, 'page/icon.svg'), join(dist, 'icon.svg'));
  writeFileSync(join(dist, 'licences.txt'), licences());
  let plain = 0;
  let packed = 0;
  writeFileSync(join(dist, 'index.html'), page);
  for (const name of readdirSync(dist)) {
    const bytes = readFileSync(join(dist, name));
    const brotli = brotliCompressSync(bytes, {params: {[constants.BROTLI_PARAM_QUALITY]: 11,
      [constants.BROTLI_PARAM_SIZE_HINT]: bytes.length}});
    writeFileSync(join(dist, `${name}.br`), brotli);
    if (!name.endsWith('.js')) continue;
    plain += bytes.length;
    packed += brotli.length;
  }
  console.log(`web client: ${(plain / 1000).toFixed(0)} kB of JavaScript, ${(packed / 1000).toFixed(0)} kB compressed`);
}
