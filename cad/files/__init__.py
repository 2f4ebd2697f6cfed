"""Solids as files; equal solids give equal bytes on every machine."""
