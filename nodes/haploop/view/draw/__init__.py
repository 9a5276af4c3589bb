"""Data sent to a page: ``messages`` are its written form, ``snapshot`` the numbers that are drawn."""
