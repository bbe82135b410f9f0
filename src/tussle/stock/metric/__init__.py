"""The metric plugins that ship, a folder each."""
