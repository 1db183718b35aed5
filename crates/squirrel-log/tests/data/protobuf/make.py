"""Makes the protobuf MCAP of the import's tests, and what Foxglove's reader reads in it.

    pip install mcap==1.6.0 mcap-protobuf-support==0.6.0 protobuf && python make.py

`flight.csv` has one number a line: topic, column of the import, row from 1, value.
"""

import csv
import math
from pathlib import Path

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

HERE = Path(__file__).parent
F = descriptor_pb2.FieldDescriptorProto
NUMBERS = ["double", "float", "int32", "int64", "uint32", "uint64", "sint32", "sint64", "fixed32", "fixed64", "sfixed32",
           "sfixed64", "bool"]  # fmt: skip


def field(message, number, name, kind, repeated=False, type_name=None):
    own = message.field.add(number=number, name=name, type=getattr(F, f"TYPE_{kind.upper()}"))
    own.label = F.LABEL_REPEATED if repeated else F.LABEL_OPTIONAL
    if type_name:
        own.type_name = type_name
    return own


file = descriptor_pb2.FileDescriptorProto(name="flight.proto", package="test", syntax="proto3")
file.dependency.append("google/protobuf/timestamp.proto")
file.enum_type.add(name="Mode").value.add(name="OFF", number=0)
file.enum_type[0].value.add(name="ON", number=1)
motor = file.message_type.add(name="Motor")
field(motor, 1, "rpm", "int32")
field(motor, 2, "name", "string")
flight = file.message_type.add(name="Flight")
field(flight, 1, "stamp", "message", type_name=".google.protobuf.Timestamp")
for i, kind in enumerate(NUMBERS):
    field(flight, 10 + i, kind + "_x", kind)
    field(flight, 40 + i, kind + "_list", kind, repeated=True)
field(flight, 70, "mode", "enum", type_name=".test.Mode")
field(flight, 71, "motors", "message", repeated=True, type_name=".test.Motor")
field(flight, 72, "inner", "message", type_name=".test.Flight.Inner")
field(flight, 73, "text", "string")
flight.oneof_decl.add(name="_maybe")
maybe = field(flight, 74, "maybe", "double")
maybe.proto3_optional, maybe.oneof_index = True, 0
field(flight.nested_type.add(name="Inner"), 1, "x", "float")

pool = descriptor_pool.DescriptorPool()
stamp = descriptor_pb2.FileDescriptorProto()
timestamp_pb2.DESCRIPTOR.CopyToProto(stamp)
pool.Add(stamp)
pool.Add(file)
Flight = message_factory.GetMessageClass(pool.FindMessageTypeByName("test.Flight"))
descriptors = descriptor_pb2.FileDescriptorSet(file=[stamp, file]).SerializeToString()


def messages():
    for i in range(4):
        own = Flight(text="x" * i)
        own.stamp.seconds, own.stamp.nanos = 1_700_000_000, 1000 * (i + 1)
        for kind in NUMBERS:
            bits = 63 if "64" in kind else 31
            value = {"bool": i % 2 == 1, "double": 0.1 * i, "float": math.nan if i == 2 else 0.5 * i}.get(kind)
            if value is None:
                value = (2**bits - 1 - i) if kind.startswith(("u", "fixed")) else -(2**bits) + 3 * i
            # The second message leaves out all that it may.
            if i != 1:
                setattr(own, kind + "_x", value)
            getattr(own, kind + "_list").extend([value] * i)
        if i != 1:
            own.mode, own.maybe, own.inner.x = 1, 2.5 * i, 0.25 * i
        for k in range(i):
            own.motors.add(rpm=1000 * k - i, name="m")
        yield own


with open(HERE / "flight.mcap", "wb") as out:
    writer = Writer(out)
    writer.start()
    schema = writer.register_schema("test.Flight", "protobuf", descriptors)
    channel = writer.register_channel("/flight", "protobuf", schema)
    for i, message in enumerate(messages()):
        writer.add_message(channel, 1000 * (i + 1), message.SerializeToString(), 0)
    writer.finish()


def leaves(message, path):
    for own in message.DESCRIPTOR.fields:
        name = f"{path}.{own.name}" if path else own.name
        repeated = own.is_repeated
        if not repeated and own.has_presence and not message.HasField(own.name):
            continue
        value = getattr(message, own.name)
        for i, one in enumerate(value if repeated else [value]):
            at = f"{name}[{i}]" if repeated else name
            if own.message_type:
                yield from leaves(one, at)
            elif not isinstance(one, str):
                yield at, one


with open(HERE / "flight.mcap", "rb") as data, open(HERE / "flight.csv", "w", newline="") as out:
    rows = csv.writer(out, lineterminator="\n")
    reader = make_reader(data, decoder_factories=[DecoderFactory()])
    for row, (_, channel, _, message) in enumerate(reader.iter_decoded_messages(), 1):
        for column, value in leaves(message, ""):
            rows.writerow([channel.topic, column, row, int(value) if isinstance(value, (bool, int)) else repr(value)])
print(sum(1 for _ in open(HERE / "flight.csv")), "numbers")
