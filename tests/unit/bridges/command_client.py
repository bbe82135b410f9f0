"""A program that sends commands by gRPC with code that protoc has generated, as clients of the existing system do.

Arguments: folder for the code, address, then network, topic and text of each command. Prints an answer for each: the number of the
acknowledgement, or code and details of the error.
"""

import sys
from pathlib import Path

import grpc
from grpc_tools import protoc

PROTO = """
syntax = "proto3";
package scrimmage_msgs;
message CommandString { string network = 1; string topic = 2; string value = 3; }
message CommandAck { int32 success = 1; }
service ScrimmageMsgService { rpc SendCommandString(CommandString) returns (CommandAck) {} }
"""

folder, address, *words = sys.argv[1:]
(Path(folder) / "Command.proto").write_text(PROTO)
arguments = [
    "protoc",
    f"-I{folder}",
    f"--python_out={folder}",
    f"--grpc_python_out={folder}",
    "Command.proto",
]
assert protoc.main(arguments) == 0
sys.path.insert(0, folder)

import Command_pb2  # noqa: E402
import Command_pb2_grpc  # noqa: E402

with grpc.insecure_channel(address) as channel:
    service = Command_pb2_grpc.ScrimmageMsgServiceStub(channel)
    for network, topic, value in zip(*[iter(words)] * 3, strict=True):
        command = Command_pb2.CommandString(network=network, topic=topic, value=value)
        try:
            print(service.SendCommandString(command, timeout=60).success)
        except grpc.RpcError as error:
            print(error.code().name, error.details())
