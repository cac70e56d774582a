"""Materials and oils by the names that workshops use, and the standards behind them."""
