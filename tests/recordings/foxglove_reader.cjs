// Every message of a recording, decoded as Foxglove and Lichtblick do it: by @mcap/core and protobufjs, with nothing but
// the descriptors in the file. `NODE_PATH=.../node_modules node foxglove_reader.cjs FILE.mcap` prints one JSON object.
const { readFileSync } = require("node:fs");
const { open } = require("node:fs/promises");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { FileHandleReadable } = require("@mcap/nodejs");
const { loadDecompressHandlers } = require("@mcap/support");
const protobuf = require("protobufjs");
const descriptor = require("protobufjs/ext/descriptor");

const OPTIONS = { enums: String, longs: String, defaults: true };

async function main(path) {
  const decompressHandlers = await loadDecompressHandlers();
  const handle = await open(path, "r");
  const reader = await McapIndexedReader.Initialize({ readable: new FileHandleReadable(handle), decompressHandlers });
  const types = new Map();
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId);
    const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schema.data));
    root.resolveAll();
    types.set(channel.id, root.lookupType(schema.name));
  }
  const topics = {};
  for await (const message of reader.readMessages()) {
    const { topic } = reader.channelsById.get(message.channelId);
    const type = types.get(message.channelId);
    (topics[topic] ??= []).push(type.toObject(type.decode(message.data), OPTIONS));
  }
  await handle.close();

  // Again from the beginning, without the index, every checksum compared.
  const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  stream.append(readFileSync(path));
  let streamed = 0;
  for (let record; (record = stream.nextRecord()); ) {
    streamed += record.type === "Message" ? 1 : 0;
  }
  console.log(JSON.stringify({ topics, streamed, done: stream.done() }));
}

main(process.argv[2]);
