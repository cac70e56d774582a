"""Work–precision studies: error against run time.

A second method checks each answer.
"""
