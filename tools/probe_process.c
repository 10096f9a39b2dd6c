// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Who runs, with what right, and who holds a file open. Processes end while
 * they are looked at; then they are as if they had not been there. Somebody
 * else's open files are hidden from a user without privilege: none seen does
 * not mean that there are none, and the callers say so.
 */
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "tools/probe.h"

/* The next number in a folder of numbers, 0 at its end. */
static int next_number(DIR *folder)
{
	const struct dirent *entry;

	while ((entry = readdir(folder))) {
		int number = atoi(entry->d_name);

		if (number > 0)
			return number;
	}
	return 0;
}

static DIR *open_folder(const char *root, const char *path)
{
	char whole[512];

	if (snprintf(whole, sizeof(whole), "%s%s", root, path) >= (int)sizeof(whole))
		return NULL;
	return opendir(whole);
}

/* It ended, and only its name is left until its parent asks. */
static bool is_dead(const char *root, int process)
{
	char text[1024], *at;

	if (!probe_text(root, text, sizeof(text), "/proc/%d/task/%d/stat", process, process))
		return false;
	at = strrchr(text, ')');
	return at && (!strncmp(at, ") Z", 3) || !strncmp(at, ") X", 3));
}

int probe_process(const char *root, const char *name)
{
	DIR *folder = open_folder(root, "/proc");
	char text[64];
	int process;

	if (!folder)
		return -1;
	while ((process = next_number(folder)))
		if (probe_text(root, text, sizeof(text), "/proc/%d/comm", process) &&
		    !strcmp(text, name) && !is_dead(root, process))
			break;
	closedir(folder);
	/* where only our own processes are to be seen, that one is missing means nothing */
	if (!process && !*root && access("/proc/1", F_OK))
		return -1;
	return process;
}

/* Fields 40 and 41 of stat: the name before them may hold anything but ends with ')'. */
static int priority_of(const char *root, int process, int thread)
{
	char text[1024], *at;
	int priority = 0, policy = 0;

	if (!probe_text(root, text, sizeof(text), "/proc/%d/task/%d/stat", process, thread))
		return 0;
	at = strrchr(text, ')');
	for (int field = 2; at && field < 40; field++)
		at = strchr(at + 1, ' ');
	if (!at || sscanf(at, "%d %d", &priority, &policy) != 2)
		return 0;
	return policy == 1 || policy == 2 ? priority : 0;
}

bool probe_realtime_thread(const char *root, int process, struct probe_thread *thread)
{
	char path[64], text[PROBE_TEXT];
	DIR *folder;
	int id;

	*thread = (struct probe_thread){ 0 };
	snprintf(path, sizeof(path), "/proc/%d/task", process);
	folder = open_folder(root, path);
	if (!folder)
		return false;
	while ((id = next_number(folder))) {
		int priority = priority_of(root, process, id);

		if (priority <= thread->priority ||
		    !probe_text(root, text, sizeof(text), "/proc/%d/task/%d/status", process, id))
			continue;
		thread->priority = priority;
		probe_line(text, "Cpus_allowed_list", thread->cores, sizeof(thread->cores));
	}
	closedir(folder);
	return true;
}

static bool holds(const char *root, int process, const char *path)
{
	char place[512], target[256];
	DIR *folder;
	const struct dirent *entry;
	bool found = false;

	snprintf(place, sizeof(place), "/proc/%d/fd", process);
	folder = open_folder(root, place);
	if (!folder)
		return false;
	while (!found && (entry = readdir(folder))) {
		ssize_t length = readlinkat(dirfd(folder), entry->d_name, target,
					    sizeof(target) - 1);

		if (length < 0)
			continue;
		target[length] = '\0';
		found = !strcmp(target, path);
	}
	closedir(folder);
	return found;
}

unsigned int probe_holders(const char *root, const char *path, char *text, size_t size)
{
	DIR *folder = open_folder(root, "/proc");
	unsigned int count = 0;
	size_t at = 0;
	int process;

	text[0] = '\0';
	if (!folder)
		return 0;
	while ((process = next_number(folder))) {
		char name[64];

		if (!holds(root, process, path))
			continue;
		probe_text(root, name, sizeof(name), "/proc/%d/comm", process);
		if (at < size)
			at += (size_t)snprintf(text + at, size - at, "%s%s (%d)", count ? ", " : "",
					       name, process);
		count++;
	}
	closedir(folder);
	return count;
}
