"""Space that lights may hang in: free of shapes, on rails, on surfaces."""
