"""The engine: plugins, clocks and rows put together."""
