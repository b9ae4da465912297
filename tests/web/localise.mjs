// node localise.mjs MODULE MEMORY DEGREES PICTURE ...: prints the answers as lines of JSON, and on standard error the
// median processor time of a picture in ms, of ten answers each. MODULE is the folder of panonav.js; pictures are grey
// or RGB PNG files without interlacing, whose edges are DEGREES apart (0: they show all azimuths).
import { readFileSync, writeFileSync } from "node:fs";
import { basename } from "node:path";
import { inflateSync } from "node:zlib";

/** [PNG 1.2, sections 3 and 6] */
function readPng(path) {
  const file = readFileSync(path);
  const parts = [];
  let at = 8;
  let width, height, channels;
  while (at < file.length) {
    const size = file.readUInt32BE(at);
    const kind = file.toString("latin1", at + 4, at + 8);
    const content = file.subarray(at + 8, at + 8 + size);
    if (kind === "IHDR") {
      [width, height] = [content.readUInt32BE(0), content.readUInt32BE(4)];
      channels = { 0: 1, 2: 3 }[content[9]];
      if (content[8] !== 8 || !channels || content[12] !== 0) throw new Error(`${path}: a PNG of another kind`);
    }
    if (kind === "IDAT") parts.push(content);
    at += size + 12;
  }
  const packed = inflateSync(Buffer.concat(parts));
  const stride = width * channels;
  const rows = new Uint8Array(height * stride);
  for (let v = 0; v < height; ++v) {
    const filter = packed[v * (stride + 1)];
    for (let i = 0; i < stride; ++i) {
      const left = i >= channels ? rows[v * stride + i - channels] : 0;
      const up = v > 0 ? rows[(v - 1) * stride + i] : 0;
      const corner = v > 0 && i >= channels ? rows[(v - 1) * stride + i - channels] : 0;
      const distances = [left, up, corner].map((value) => Math.abs(left + up - corner - value));
      const paeth = distances[0] <= distances[1] && distances[0] <= distances[2] ? left
        : distances[1] <= distances[2] ? up : corner;
      const predicted = [0, left, up, (left + up) >> 1, paeth][filter];
      rows[v * stride + i] = packed[v * (stride + 1) + 1 + i] + predicted;
    }
  }
  const data = new Uint8ClampedArray(4 * width * height).fill(255);
  for (let i = 0; i < width * height; ++i) {
    for (let c = 0; c < 3; ++c) data[4 * i + c] = rows[i * channels + (channels === 3 ? c : 0)];
  }
  return { width, height, data };
}

const [folder, memoryFile, degrees, ...pictures] = process.argv.slice(2);
const { loadPanonav } = await import(`${folder}/panonav.js`);
const panonav = await loadPanonav({ wasmBinary: readFileSync(`${folder}/panonav_web.wasm`) });
const memory = panonav.open(readFileSync(memoryFile));
const times = [];
for (const path of pictures) {
  const picture = readPng(path);
  console.log(memory.localise(picture, basename(path), Number(degrees)));
  for (let i = 1; i < 10; ++i) {
    const before = process.cpuUsage();
    memory.localise(picture, basename(path), Number(degrees));
    times.push(process.cpuUsage(before).user / 1000);
  }
}
console.error(times.sort((a, b) => a - b)[times.length >> 1].toFixed(2));
