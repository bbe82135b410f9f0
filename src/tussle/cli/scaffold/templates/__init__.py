"""What `tussle new` begins with: a plugin of each kind that works as it stands, called New here."""
