"""What plugins declare: columns, messages and their topics, with units and texts."""
