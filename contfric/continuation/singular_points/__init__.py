"""Where the equations of an orbit are singular: folds, branch points, doublings, and what leaves them."""
