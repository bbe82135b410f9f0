"""Messages of gRPC services, made from short declarations, so that no generated code is kept."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

from tussle.errors import MissingExtraError

NUMBERS = {"double": 1, "int32": 5, "bool": 8, "string": 9, "message": 11}
"""Type of a field -> its number in a FieldDescriptorProto."""
OPTIONAL, REPEATED = 1, 3
COMMANDS = MappingProxyType({
    "CommandString": "string network, string topic, string value",
    "CommandAck": "int32 success",
})  # fmt: skip
"""Package scrimmage_msgs: requests and answers of the service ScrimmageMsgService."""
SEND_COMMAND = "/scrimmage_msgs.ScrimmageMsgService/SendCommandString"


def load_grpc(where: str) -> Any:
    """The module grpc.

    Raises:
        MissingExtraError: grpcio or protobuf are not installed.
    """
    try:
        import google.protobuf  # noqa: F401
        import grpc
    except ImportError:
        raise MissingExtraError(f"{where} needs grpcio and protobuf: pip install 'tussle[grpc]'") from None
    return grpc


@cache
def message_types(package: str, **declared: str) -> Mapping[str, Any]:
    """Classes of messages by name; fields are numbered from 1 in the order given.

    Args:
        package: Package of the messages.
        **declared: Name of a message -> its fields, such as "int32 count, repeated double values, Point where"; a field of another
            message has its name as type.
    """
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    file = descriptor_pb2.FileDescriptorProto(name=f"{package}.proto", package=package, syntax="proto3")
    for name, fields in declared.items():
        message = file.message_type.add(name=name)
        for number, text in enumerate(filter(None, fields.split(", ")), 1):
            *label, kind, field = text.split()
            one = message.field.add(name=field, number=number, label=REPEATED if label else OPTIONAL)
            one.type = NUMBERS.get(kind, NUMBERS["message"])
            if kind not in NUMBERS:
                one.type_name = f".{package}.{kind}"
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    find = pool.FindMessageTypeByName
    return MappingProxyType(
        {name: message_factory.GetMessageClass(find(f"{package}.{name}")) for name in declared}
    )
