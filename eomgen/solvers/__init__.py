"""Static equilibria and consistent states, on a product of Lie groups; arrays only."""
