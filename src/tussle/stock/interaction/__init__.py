"""The interaction plugins that ship, a folder each."""
