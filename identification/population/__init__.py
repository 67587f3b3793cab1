"""What many valves teach: estimates pooled over a type, valves unlike all others, and trends of one valve."""

from identification.population.outlyingness import Outlyingness, outliers
from identification.population.pooling import Pooled, pooled
from identification.population.trends import EstimateChange, Trend, change, trend

__all__ = ["EstimateChange", "Outlyingness", "Pooled", "Trend", "change", "outliers", "pooled", "trend"]
