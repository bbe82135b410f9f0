"""Message delivery: outboxes, queues and inboxes."""

from tussle.declare.comms.topic import EVERYONE, SAME_ENTITY, Inbox, Publisher, TopicBuffer

__all__ = ["EVERYONE", "SAME_ENTITY", "Inbox", "Publisher", "TopicBuffer"]
