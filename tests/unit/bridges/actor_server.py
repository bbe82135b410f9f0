"""A server of actors, with code that protoc generates: discrete actions are 1 while x is negative, continuous ones are 3.

Arguments: folder for the code, port, and "wrong" for one number too many. Prints a line when it serves, and one for each environment.
"""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import grpc
from grpc_tools import protoc

PROTO = """
syntax = "proto3";
package scrimmage_proto;
service OpenAI { rpc SendEnvironment(Environment) returns (Empty) {} rpc GetAction(Obs) returns (Action) {} }
message Range { double min = 1; double max = 2; }
message Space { repeated int32 discrete = 1; repeated Range continuous = 2; }
message Environment { Space action = 1; Space observation = 2; double least = 3; double most = 4; map<string, string> params = 5; }
message Obs { repeated int32 discrete = 1; repeated double continuous = 2; }
message Action { repeated int32 discrete = 1; repeated double continuous = 2; bool done = 3; }
message Empty {}
"""

folder, port, *words = sys.argv[1:]
is_wrong = "wrong" in words
(Path(folder) / "Actors.proto").write_text(PROTO)
arguments = ["protoc", f"-I{folder}", f"--python_out={folder}", f"--grpc_python_out={folder}", "Actors.proto"]
assert protoc.main(arguments) == 0
sys.path.insert(0, folder)

import Actors_pb2 as messages  # noqa: E402
import Actors_pb2_grpc as services  # noqa: E402


class Actors(services.OpenAIServicer):
    def __init__(self):
        self.spaces = {}

    def SendEnvironment(self, environment, context):
        space = self.spaces[self.who(context)] = environment.action
        ranges = [(one.min, one.max) for one in space.continuous]
        seen = [(one.min, one.max) for one in environment.observation.continuous]
        print(
            list(space.discrete),
            ranges,
            seen,
            environment.least,
            environment.most,
            environment.params["max_speed"],
        )
        return messages.Empty()

    def GetAction(self, observation, context):
        x, space = (*observation.continuous, 0.0)[0], self.spaces[self.who(context)]
        if x > 1000:
            context.abort(grpc.StatusCode.INTERNAL, "too far")
        return messages.Action(
            discrete=[int(x < 0)] * len(space.discrete), continuous=[3.0] * (len(space.continuous) + is_wrong)
        )

    @staticmethod
    def who(context):
        """World and id of the entity that asks."""
        told = dict(context.invocation_metadata())
        return int(told["world"]), int(told["entity"])


server = grpc.server(ThreadPoolExecutor(2))
services.add_OpenAIServicer_to_server(Actors(), server)
assert server.add_insecure_port(f"127.0.0.1:{port}")
server.start()
print("ready", flush=True)
sys.stdin.read()
server.stop(None).wait()
