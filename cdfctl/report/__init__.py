"""What people see: summaries and tables, as Rich renderables. Nothing here prints."""
