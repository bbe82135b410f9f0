"""The network plugins that ship, a folder each."""
