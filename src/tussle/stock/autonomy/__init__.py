"""The autonomy plugins that ship, a folder each."""
