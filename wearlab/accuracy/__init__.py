"""Work–precision studies: error against run time, each answer checked by a second method."""
