"""What a person looks at: pictures, tables and sentences about a result. It solves nothing."""
