"""What can be made of a recorded run: a page that plays it, films and pictures, tables."""
