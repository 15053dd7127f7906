"""The main job: every strategy on the slosh profile of Table II and on a real recording, then a
diagnosis of what the model of that recording leaves out.

`slosh` and `pendulum` fit, `run` does one after the other; what they find is printed and written
by `pikanid.reporting`.
"""
