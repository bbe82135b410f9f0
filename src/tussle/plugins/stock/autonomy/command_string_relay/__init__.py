"""CommandStringRelay and TopicRelay: pass texts from one network to another."""

from tussle.plugins.stock.autonomy.command_string_relay.plugin import CommandStringRelay, TopicRelay

__all__ = ["CommandStringRelay", "TopicRelay"]
