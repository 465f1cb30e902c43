"""Recordings as nobody writes them: cut, flipped, lied to, with hostile contents behind right checksums."""

from __future__ import annotations

import random
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import zstandard
from mcap.opcode import Opcode

from recordings import Geometry, RunWriter
from recordings.descriptors import descriptor_set
from recordings.schema import CYCLE, FORECAST
from twin.cycle import CanFrame, CycleRecord, Estimated, Event, Forecasted, Missed

START_NS = 1_760_000_000_000_000_000
CHUNK_HEAD = struct.Struct("<QQQII")
HOSTILE = (0, 1, 0x7F, 0xFF, 2**15, 2**24, 2**31 - 1, 2**32 - 1, 2**40, 2**63 - 1, 2**63, 2**64 - 1)

Record = tuple[int, bytes]
Mutation = Callable[[bytes, random.Random], bytes]


def records_of(cycles: int) -> list[CycleRecord]:
    """Cycles with every optional part."""
    made: list[CycleRecord] = []
    for k in range(cycles):
        forecast = Forecasted("rocked", 0.1 * k, 0.25, k * 1e-2, "overturned", -0.1, 1.0, 0.6, "too late", 0.0, 32)
        values = [(-1.0) ** k * (0.01 * k + 0.001 * part) for part in range(7)]
        made.append(
            CycleRecord(
                k,
                k * 1e-3,
                START_NS + k * 1_000_000,
                *values,
                0x1237,
                forecast if k % 5 == 0 else None,
                Estimated(0.1, 0.2, 0.9, 0.01) if k % 3 == 0 else None,
            )
        )
    return made


def write_reference(path: Path, cycles: int = 60) -> list[CycleRecord]:
    """Write a small recording with everything in it, in several chunks; return its cycles."""
    records = records_of(cycles)
    writer = RunWriter(path, {"scene": {"name": "fuzz", "json": "{}"}}, Geometry(0.06, 0.27), overwrite=True)
    for record in records:
        writer.cycle(record)
        if record.cycle % 20 == 7:
            writer.missed(Missed(1000 + record.cycle, 1001 + record.cycle, record.host_time_ns))
            writer.event(Event(record.time, record.host_time_ns, "warning", "impact", "at the corner"))
            writer.frame(CanFrame(record.host_time_ns, 0x181, b"\x01\x02\x03", False))
        # A write every ten cycles, as if they were 5 ms apart.
        writer.tick(record.cycle * 5e-3)
    writer.finish({"result": {"outcome": "ROCKED"}})
    return records


def split_file(data: bytes) -> list[Record]:
    """Opcode and body of every record between the magics of a whole file."""
    found: list[Record] = []
    offset = 8
    while offset < len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, offset)
        found.append((opcode, data[offset + 9 : offset + 9 + length]))
        offset += 9 + length
    return found


def join_file(magic: bytes, records: list[Record]) -> bytes:
    """Put records together again; offsets and checksums of the file are those of before."""
    return magic + b"".join(struct.pack("<BQ", opcode, len(body)) + body for opcode, body in records) + magic


def open_chunk_body(body: bytes) -> bytes:
    """Decompressed records of one of our chunks."""
    return lz4.frame.decompress(body[CHUNK_HEAD.size + 3 + 8 :])


def chunk_body(plain: bytes, *, zstd: bool = False, declared: int | None = None) -> bytes:
    """Body of a chunk record that holds `plain` and proves it, whatever it is."""
    name, packed = (b"zstd", zstandard.compress(plain)) if zstd else (b"lz4", lz4.frame.compress(plain))
    size = len(plain) if declared is None else declared
    head = CHUNK_HEAD.pack(1, 2, size % 2**64, zlib.crc32(plain), len(name))
    return head + name + struct.pack("<Q", len(packed)) + packed


def message(channel: int, payload: bytes, rng: random.Random) -> bytes:
    """A message record with stamps of any size."""
    stamps = struct.pack("<IQQ", rng.getrandbits(32), rng.choice(HOSTILE), rng.choice(HOSTILE))
    body = struct.pack("<H", channel) + stamps + payload
    return struct.pack("<BQ", Opcode.MESSAGE, len(body)) + body


def cut(data: bytes, rng: random.Random) -> bytes:
    """Cut the file off."""
    return data[: rng.randrange(len(data))]


def flip(data: bytes, rng: random.Random) -> bytes:
    """Change bits."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def lie(data: bytes, rng: random.Random) -> bytes:
    """Put a hostile number anywhere."""
    changed = bytearray(data)
    place = rng.randrange(len(changed) - 8)
    size = rng.choice((2, 4, 8))
    changed[place : place + size] = (rng.choice(HOSTILE) % 256**size).to_bytes(size, "little")
    return bytes(changed)


def lie_of_length(data: bytes, rng: random.Random) -> bytes:
    """Give one record, or something in it, another length."""
    records = split_file(data)
    place = 8 + sum(9 + len(body) for _, body in records[: rng.randrange(len(records))])
    changed = bytearray(data)
    changed[place + 1 : place + 9] = struct.pack("<Q", rng.choice((*HOSTILE, len(data), len(data) - place)))
    return bytes(changed)


def shuffle(data: bytes, rng: random.Random) -> bytes:
    """Leave records out, repeat them, swap them."""
    records = split_file(data)
    for _ in range(rng.randrange(1, 6)):
        one, other = rng.randrange(len(records)), rng.randrange(len(records))
        how = rng.randrange(3)
        if how == 0:
            del records[one]
        elif how == 1:
            records.insert(other, records[one])
        else:
            records[one], records[other] = records[other], records[one]
    return join_file(data[:8], records)


def splice(data: bytes, rng: random.Random) -> bytes:
    """Put a piece of the file somewhere else in it, or noise."""
    start = rng.randrange(len(data))
    piece = (
        data[start : start + rng.randrange(1, 4000)] if rng.random() < 0.5 else rng.randbytes(rng.randrange(1, 4000))
    )
    place = rng.randrange(8, len(data))
    return data[:place] + piece + data[place + rng.choice((0, len(piece))) :]


def change_chunk(data: bytes, rng: random.Random) -> bytes:
    """Change what a chunk holds and give it the checksum of that."""
    records = split_file(data)
    places = [place for place, (opcode, _) in enumerate(records) if opcode == Opcode.CHUNK]
    place = rng.choice(places)
    plain = bytearray(open_chunk_body(records[place][1]))
    for _ in range(rng.choice((1, 3, 20))):
        at = rng.randrange(len(plain))
        size = rng.choice((1, 4, 8))
        plain[at : at + size] = (rng.choice((*HOSTILE, rng.getrandbits(64))) % 256**size).to_bytes(size, "little")
    records[place] = (Opcode.CHUNK, chunk_body(bytes(plain), zstd=rng.random() < 0.5))
    return join_file(data[:8], records)


def hostile_messages(data: bytes, rng: random.Random) -> bytes:
    """Add a chunk of messages with any payload, in channels that are there and that are not."""
    payloads = [
        b"",
        rng.randbytes(rng.randrange(80)),
        b"\xff" * 11,
        b"\x09" + bytes(8),
        b"\x08" + b"\xff" * 9 + b"\x01",
    ]
    plain = b"".join(message(rng.randrange(16), rng.choice(payloads), rng) for _ in range(rng.choice((1, 10, 300))))
    return _insert(data, chunk_body(plain), rng)


def wrong_schema(data: bytes, rng: random.Random) -> bytes:
    """Give channels another schema: other descriptors, noise, another encoding, another name."""
    records = split_file(data)
    others = [descriptor_set(CYCLE), descriptor_set(FORECAST), b"", rng.randbytes(200)]
    definitions: list[bytes] = []
    for number in range(1, 16):
        schema = rng.choice(others)
        name = rng.choice((b"shake_table_twin.Cycle", b"shake_table_twin.Forecast", b"foxglove.Log", b"\xff\xfe", b""))
        encoding = rng.choice((b"protobuf", b"jsonschema", b""))
        body = struct.pack("<H", number) + b"".join(
            struct.pack("<I", len(part)) + part for part in (name, encoding, schema)
        )
        topic = rng.choice((b"/cycle", b"/forecast", b"/events", b"/table/target", b"/other"))
        channel = struct.pack("<HH", number, rng.randrange(18)) + b"".join(
            struct.pack("<I", len(part)) + part for part in (topic, encoding, b"")
        )
        for opcode, part in ((Opcode.SCHEMA, body), (Opcode.CHANNEL, channel)):
            definitions.append(struct.pack("<BQ", opcode, len(part)) + part)
    chosen = b"".join(rng.sample(definitions, rng.randrange(1, len(definitions))))
    if rng.random() < 0.5:
        return _insert(data, chunk_body(chosen), rng)
    place = rng.randrange(1, len(records))
    return join_file(data[:8], [*records[:place], *split_file(bytes(8) + chosen + bytes(8)), *records[place:]])


def bomb(data: bytes, rng: random.Random) -> bytes:
    """Add chunks that want to be much larger than they are."""
    size = rng.choice((10**5, 10**6, 2 * 10**6))
    one = message(rng.randrange(1, 8), bytes(rng.choice((0, 9, 18, 27))), rng)
    plain = rng.choice(
        (
            bytes(size),
            one * (size // len(one)),
            struct.pack("<BQ", 0x80, 0) * (size // 9),
            (one + struct.pack("<BQ", 0x80, 0)) * (size // (len(one) + 9)),
        )
    )
    declared = rng.choice((None, 10, size * 2, 2**40, 2**63))
    body = chunk_body(plain, zstd=rng.random() < 0.5, declared=declared)
    for _ in range(rng.choice((1, 1, 8))):
        data = _insert(data, body, rng)
    return data


def hostile_metadata(data: bytes, rng: random.Random) -> bytes:
    """Add metadata that lie of themselves."""
    pairs = b"".join(
        struct.pack("<I", len(part)) + part
        for _ in range(rng.randrange(3))
        for part in (b"major", rng.choice((b"1", b"2", b"999999999999", b"\xff", "é".encode())))
    )
    name = rng.choice((b"schema", b"geometry", b"clock", b"recorder", b"\xc3", b""))
    length = rng.choice((len(pairs), *HOSTILE)) % 2**32
    body = struct.pack("<I", len(name)) + name + struct.pack("<I", length) + pairs
    records = split_file(data)
    place = rng.randrange(1, len(records))
    return join_file(data[:8], [*records[:place], (Opcode.METADATA, body), *records[place:]])


def _insert(data: bytes, body: bytes, rng: random.Random) -> bytes:
    """Put a chunk record somewhere among the records."""
    records = split_file(data)
    place = rng.randrange(1, len(records))
    return join_file(data[:8], [*records[:place], (Opcode.CHUNK, body), *records[place:]])


HARMLESS: dict[str, Mutation] = {
    "cut": cut,
    "flip": flip,
    "lie": lie,
    "lie of length": lie_of_length,
    "splice": splice,
    "bomb": bomb,
}
"""Mutations after which no cycle may be read that was not written, bit for bit."""
FORGED: dict[str, Mutation] = {
    "shuffle": shuffle,
    "change chunk": change_chunk,
    "hostile messages": hostile_messages,
    "wrong schema": wrong_schema,
    "hostile metadata": hostile_metadata,
}
"""Mutations with right checksums: what is read may be anything, but nothing may go wrong."""
