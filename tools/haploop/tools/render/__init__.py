"""Text for people: numbers with units, tables, progress, and fixed sentences."""
