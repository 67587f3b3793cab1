"""A second opinion from sparse regression of the recorded force, which borrows nothing from the fit."""
