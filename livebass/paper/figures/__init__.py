"""The paper's cases and figures."""
