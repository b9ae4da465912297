// The reference library of MCAP for tests of ours: npm's @mcap/core with @mcap/nodejs,
// @foxglove/wasm-lz4, @foxglove/wasm-zstd and lz4js, looked for in the folder node_modules of the folder
// that MCAP_NODE names.
//   node mcap_core.mjs write FOLDER   makes the files mcap_*.mcap of tests/io/data
//   node mcap_core.mjs read FILE      prints what it reads, through the index and as a stream, as JSON
//   node mcap_core.mjs variants FOLDER   makes a file of each way to leave out optional records, with and
//                                     without unknown fields at their ends: COUNT-NAMES.mcap
//   node mcap_core.mjs speed FILE     GB/s of messages read through the index; and written, beside it
import { createRequire } from "node:module";
import fs from "node:fs";
import path from "node:path";

const require = createRequire(path.join(path.resolve(process.env.MCAP_NODE ?? "."), "x.js"));
const { McapWriter, McapIndexedReader, McapRecordBuilder, McapStreamReader, Opcode } = require("@mcap/core");
const { FileHandleReadable, FileHandleWritable } = require("@mcap/nodejs");
const lz4 = require("@foxglove/wasm-lz4");
const lz4js = require("lz4js");
const zstd = require("@foxglove/wasm-zstd");

const decompressHandlers = {
  lz4: (buffer, size) => lz4(buffer, Number(size)),
  zstd: (buffer, size) => zstd.decompress(buffer, Number(size)),
};
const compressors = {
  none: undefined,
  lz4: (data) => ({ compression: "lz4", compressedData: Buffer.from(lz4js.compress(data)) }),
  zstd: (data) => ({ compression: "zstd", compressedData: zstd.compress(data) }),
};

// Message i: topic, time and bytes as tests/io/recording_test.cpp expects them.
function message(i) {
  const data = new Uint8Array(10 + 3 * i);
  for (let k = 0; k < data.length; ++k) data[k] = (7 * i + k) & 255;
  return { channel: i % 3 === 2 ? 1 : 0, time: 1000000000n + 10000000n * BigInt(i), data };
}

async function write(file, options, startsWithMessages) {
  const handle = await fs.promises.open(file, "w");
  const writer = new McapWriter({ writable: new FileHandleWritable(handle), chunkSize: 300, ...options });
  await writer.start({ profile: "ros2", library: "test" });
  const schema = await writer.registerSchema({
    name: "sensor_msgs/msg/Imu", encoding: "ros2msg", data: new TextEncoder().encode("float64 x"),
  });
  const channels = [
    await writer.registerChannel({ topic: "/imu", schemaId: schema, messageEncoding: "cdr", metadata: new Map([["k", "v"]]) }),
    await writer.registerChannel({ topic: "/text", schemaId: 0, messageEncoding: "json", metadata: new Map() }),
  ];
  for (let i = 0; i < 20; ++i) {
    const { channel, time, data } = message(i);
    await writer.addMessage({ channelId: channels[channel], sequence: i, logTime: time, publishTime: time, data });
    if (i === 10) {
      await writer.addAttachment({ name: "a.txt", mediaType: "text/plain", logTime: time, createTime: time, data: new Uint8Array([1, 2, 3]) });
      await writer.addMetadata({ name: "m", metadata: new Map([["a", "b"]]) });
    }
  }
  await writer.end();
  await handle.close();
}

// What the format leaves to the writer, as the conformance tests of the format vary it.
const optional = ["ch", "mx", "st", "rsh", "rch", "chx", "sum", "pad"];
function writeVariants(folder) {
  for (let bits = 0; bits < 1 << optional.length; ++bits) {
    const has = Object.fromEntries(optional.map((name, i) => [name, ((bits >> i) & 1) === 1]));
    if (!has.ch && (has.mx || has.chx)) continue;
    for (const count of [0, 1, 10]) {
      const names = optional.filter((name) => has[name]);
      fs.writeFileSync(path.join(folder, `${count}-${names.join("-")}.mcap`), variant(has, count));
    }
  }
}

function variant(has, count) {
  const out = new McapRecordBuilder({ padRecords: has.pad });
  out.writeMagic();
  out.writeHeader({ profile: "", library: "" });
  const schema = { id: 1, name: "Example", encoding: "c", data: new Uint8Array([4, 5, 6]) };
  const channel = { id: 1, schemaId: 1, topic: "/imu", messageEncoding: "cdr", metadata: new Map([["a", "b"]]) };
  const records = has.ch ? new McapRecordBuilder({ padRecords: has.pad }) : out;
  const index = [];
  if (count > 0) {
    records.writeSchema(schema);
    records.writeChannel(channel);
  }
  for (let i = 0; i < count; ++i) {
    index.push([BigInt(i), BigInt(records.length)]);
    records.writeMessage({ channelId: 1, sequence: i, logTime: BigInt(i), publishTime: 0n, data: new Uint8Array([i, i]) });
  }
  const chunkIndexes = [];
  if (has.ch && count > 0) {
    const chunk = {
      messageStartTime: 0n, messageEndTime: BigInt(count - 1), uncompressedSize: BigInt(records.length),
      uncompressedCrc: 0, compression: "", records: records.buffer,
    };
    const chunkStartOffset = BigInt(out.length);
    const chunkLength = out.writeChunk(chunk);
    const messageIndexOffsets = new Map(has.mx ? [[1, BigInt(out.length)]] : []);
    const messageIndexLength = has.mx ? out.writeMessageIndex({ channelId: 1, records: index }) : 0n;
    chunkIndexes.push({
      ...chunk, chunkStartOffset, chunkLength, messageIndexOffsets, messageIndexLength,
      compressedSize: chunk.uncompressedSize,
    });
  }
  out.writeDataEnd({ dataSectionCrc: 0 });
  const groups = [];
  const summaryStart = BigInt(out.length);
  const group = (groupOpcode, wanted, put) => {
    const groupStart = BigInt(out.length);
    if (wanted) put();
    const groupLength = BigInt(out.length) - groupStart;
    if (groupLength > 0n) groups.push({ groupOpcode, groupStart, groupLength });
  };
  group(Opcode.SCHEMA, has.rsh && count > 0, () => out.writeSchema(schema));
  group(Opcode.CHANNEL, has.rch && count > 0, () => out.writeChannel(channel));
  group(Opcode.STATISTICS, has.st, () => out.writeStatistics({
    messageCount: BigInt(count), schemaCount: count > 0 ? 1 : 0, channelCount: count > 0 ? 1 : 0, attachmentCount: 0,
    metadataCount: 0, chunkCount: chunkIndexes.length, messageStartTime: 0n, messageEndTime: BigInt(Math.max(count - 1, 0)),
    channelMessageCounts: new Map(count > 0 ? [[1, BigInt(count)]] : []),
  }));
  group(Opcode.CHUNK_INDEX, has.chx, () => chunkIndexes.forEach((one) => out.writeChunkIndex(one)));
  const summaryOffsetStart = BigInt(out.length);
  if (has.sum) groups.forEach((one) => out.writeSummaryOffset(one));
  out.writeFooter({
    summaryStart: groups.length > 0 ? summaryStart : 0n, summaryOffsetStart: has.sum && groups.length > 0 ? summaryOffsetStart : 0n,
    summaryCrc: 0,
  });
  out.writeMagic();
  return out.buffer;
}

async function openIndexed(file) {
  const handle = await fs.promises.open(file, "r");
  return McapIndexedReader.Initialize({ readable: new FileHandleReadable(handle), decompressHandlers });
}

async function read(file) {
  const reader = await openIndexed(file);
  const messages = [];
  for await (const m of reader.readMessages()) {
    const channel = reader.channelsById.get(m.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    messages.push([channel.topic, schema?.name ?? "", channel.messageEncoding, String(m.logTime), Buffer.from(m.data).toString("hex")]);
  }
  const attachments = [], metadata = [];
  for await (const a of reader.readAttachments()) attachments.push([a.name, a.mediaType, Buffer.from(a.data).toString("hex")]);
  for await (const m of reader.readMetadata()) metadata.push([m.name, [...m.metadata]]);
  const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  stream.append(fs.readFileSync(file));
  let streamed = 0;
  for (let record; (record = stream.nextRecord()); ) streamed += record.type === "Message" ? 1 : 0;
  console.log(JSON.stringify({
    messages, attachments, metadata, streamed, profile: reader.header.profile,
    statistics: String(reader.statistics.messageCount), chunks: reader.chunkIndexes.length, done: stream.done(),
  }));
}

async function speed(file) {
  const reader = await openIndexed(file);
  let bytes = 0, start = performance.now();
  for await (const m of reader.readMessages()) bytes += m.data.byteLength;
  console.log(`read ${(bytes / (performance.now() - start) / 1e6).toFixed(2)} GB/s`);
  const handle = await fs.promises.open(file + ".copy", "w");
  const writer = new McapWriter({ writable: new FileHandleWritable(handle), chunkSize: 1 << 20 });
  await writer.start({ profile: "", library: "" });
  const channelId = await writer.registerChannel({ topic: "/t", schemaId: 0, messageEncoding: "cdr", metadata: new Map() });
  const data = new Uint8Array(100000).map((_, k) => k);
  start = performance.now();
  for (let i = 0; i < 5000; ++i) {
    await writer.addMessage({ channelId, sequence: i, logTime: BigInt(i), publishTime: BigInt(i), data });
  }
  await writer.end();
  console.log(`write ${(5000 * data.length / (performance.now() - start) / 1e6).toFixed(2)} GB/s`);
  fs.unlinkSync(file + ".copy");
}

await lz4.isLoaded;
await zstd.isLoaded;
const [verb, target] = process.argv.slice(2);
if (verb === "write") {
  for (const [name, compressChunk] of Object.entries(compressors)) {
    await write(path.join(target, `mcap_${name}.mcap`), { compressChunk });
  }
  await write(path.join(target, "mcap_unchunked.mcap"), { useChunks: false });
  await write(path.join(target, "mcap_bare.mcap"), {
    useStatistics: false, useSummaryOffsets: false, repeatSchemas: false, repeatChannels: false,
    useAttachmentIndex: false, useMetadataIndex: false, useMessageIndex: false, useChunkIndex: false,
  });
} else if (verb === "variants") {
  writeVariants(target);
} else if (verb === "read") {
  await read(target);
} else {
  await speed(target);
}
