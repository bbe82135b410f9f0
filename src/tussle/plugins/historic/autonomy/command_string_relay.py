"""CommandStringRelay as in SCRIMMAGE."""

from tussle.api import Children
from tussle.plugins.stock.autonomy import command_string_relay
from tussle.plugins.stock.autonomy.command_string_relay import TopicRelay


class CommandStringRelay(command_string_relay.CommandStringRelay):
    """CommandStringRelay that passes State and Distance to LocalNetwork where no relays are given; in tussle it passes nothing."""

    relays = Children(
        TopicRelay,
        fields="source topic target",
        default=(TopicRelay(), TopicRelay(topic="Distance", name="TopicRelay_2")),
        doc="The relays.",
    )
