"""Which effect the model lacks: screened, refined, judged on held-out data, and named."""
