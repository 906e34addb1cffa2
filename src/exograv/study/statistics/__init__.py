"""What a study can say, and what it cannot: people are compared, never touches as if each were a person of its own."""
