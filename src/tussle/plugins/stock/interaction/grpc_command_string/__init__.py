"""GRPCCommandString: texts from programs, by gRPC."""

from tussle.plugins.stock.interaction.grpc_command_string.plugin import GRPCCommandString

__all__ = ["GRPCCommandString"]
