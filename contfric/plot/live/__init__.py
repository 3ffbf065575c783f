"""A diagram as one page for a browser: click a point and see its orbit.

``collect`` turns a diagram into plain data, ``page`` draws them with bokeh and writes the file, and
``page.js``, which runs in the browser, shows what is asked for.
"""
