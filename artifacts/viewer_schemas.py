"""Foxglove's well-known message types, as far as a flight needs them, so that viewers draw it unasked.

Field numbers are those of foxglove/*.proto; the types live in a descriptor pool of their own and so cannot
collide with another package that brings them.
"""

from typing import Any

from google.protobuf import descriptor_pb2, timestamp_pb2
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from mcap_protobuf.schema import build_file_descriptor_set

_Field = descriptor_pb2.FieldDescriptorProto
_KINDS = {"double": _Field.TYPE_DOUBLE, "string": _Field.TYPE_STRING}
_STAMP = "google.protobuf.Timestamp"
_MESSAGES = {
    "Vector3": (("x", 1, "double"), ("y", 2, "double"), ("z", 3, "double")),
    "Quaternion": (("x", 1, "double"), ("y", 2, "double"), ("z", 3, "double"), ("w", 4, "double")),
    "Pose": (("position", 1, "foxglove.Vector3"), ("orientation", 2, "foxglove.Quaternion")),
    "PoseInFrame": (("timestamp", 1, _STAMP), ("frame_id", 2, "string"), ("pose", 3, "foxglove.Pose")),
    "LocationFix": (
        ("latitude", 1, "double"),
        ("longitude", 2, "double"),
        ("altitude", 3, "double"),
        ("timestamp", 6, _STAMP),
        ("frame_id", 7, "string"),
    ),
}


def _pool() -> DescriptorPool:
    pool = DescriptorPool()
    stamp = descriptor_pb2.FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(stamp)
    pool.Add(stamp)
    for name, fields in _MESSAGES.items():
        file = descriptor_pb2.FileDescriptorProto(
            name=f"foxglove/{name}.proto", package="foxglove", syntax="proto3"
        )
        message = file.message_type.add(name=name)
        for label, number, kind in fields:
            field = message.field.add(name=label, number=number, label=_Field.LABEL_OPTIONAL)
            if kind in _KINDS:
                field.type = _KINDS[kind]
                continue
            field.type, field.type_name = _Field.TYPE_MESSAGE, f".{kind}"
            needed = stamp.name if kind == _STAMP else f"foxglove/{kind.removeprefix('foxglove.')}.proto"
            if needed not in file.dependency:
                file.dependency.append(needed)
        pool.Add(file)
    return pool


_POOL = _pool()
LocationFix: Any = GetMessageClass(_POOL.FindMessageTypeByName("foxglove.LocationFix"))
PoseInFrame: Any = GetMessageClass(_POOL.FindMessageTypeByName("foxglove.PoseInFrame"))


def descriptor_set(message_class: Any) -> bytes:
    """The protobuf FileDescriptorSet that an MCAP schema record carries."""
    return bytes(build_file_descriptor_set(message_class).SerializeToString(deterministic=True))
