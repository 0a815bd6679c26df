"""Report pages, pictures, tables and sentences about a result; this room solves nothing."""
