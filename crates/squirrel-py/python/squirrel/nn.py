"""Learned models of the force on spread wings: windows from flights, training, weights."""

from squirrel._squirrel import Model, forward, load, train, windows

__all__ = ["Model", "forward", "load", "train", "windows"]
